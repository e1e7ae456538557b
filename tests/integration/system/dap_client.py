#!/usr/bin/env python3
"""A client of the Debug Adapter Protocol for the stories: dap_client.py PORT story|garbage|second|vanish, PORT vscode PACKAGE_JSON,
or PORT text SOURCE"""
import json
import socket
import sys

PATIENCE = 30


class Client:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
        self.pending = b""
        self.sequence = 0
        self.events = []

    def receive(self):
        while b"\r\n\r\n" not in self.pending:
            self.pending += self.more()
        head, rest = self.pending.split(b"\r\n\r\n", 1)
        length = int(head.split(b":")[1])
        while len(rest) < length:
            rest += self.more()
        self.pending = rest[length:]
        return json.loads(rest[:length])

    def more(self):
        data = self.socket.recv(65536)
        if not data:
            raise EOFError
        return data

    def ask(self, command, expect=True, **arguments):
        self.sequence += 1
        body = json.dumps({"seq": self.sequence, "type": "request", "command": command, "arguments": arguments})
        self.socket.sendall(f"Content-Length: {len(body)}\r\n\r\n{body}".encode())
        while True:
            message = self.receive()
            if message["type"] == "event":
                self.events.append(message)
                continue
            assert message["request_seq"] == self.sequence and message["command"] == command, message
            assert message["success"] == expect, message
            return message.get("body", {})

    def event(self, name):
        while True:
            for message in self.events:
                if message["event"] == name:
                    self.events.remove(message)
                    return message["body"]
            message = self.receive()
            assert message["type"] == "event", message
            self.events.append(message)


def attached(port, **arguments):
    client = Client(port)
    assert client.ask("initialize", adapterID="test")["supportsConditionalBreakpoints"]
    client.ask("stackTrace", expect=False, threadId=1)
    client.ask("attach", **arguments)
    client.event("initialized")
    return client


def stack(client, thread):
    return client.ask("stackTrace", threadId=thread)["stackFrames"]


def story(port):
    client = attached(port)
    made = client.ask("setBreakpoints", source={"path": "/engineer/src/steps.st"},
                      breakpoints=[{"line": 13, "condition": "n > 3"}, {"line": 900}])["breakpoints"]
    assert made[0]["verified"] and made[0]["line"] == 14, made
    assert not made[1]["verified"] and "statement" in made[1]["message"], made
    for wrong in ({"condition": "n > 5000 log n"}, {"condition": 5}, {"logMessage": "a\nb"}, {"hitCondition": ["="]}):
        made = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "Main", **wrong}])["breakpoints"]
        assert not made[0]["verified"] and list(wrong)[0] in made[0]["message"], made
    client.ask("setExceptionBreakpoints", filters=[])
    client.ask("configurationDone")
    threads = {one["name"]: one["id"] for one in client.ask("threads")["threads"]}
    assert set(threads) == {"Main", "Other", "Edge"}, threads
    main = threads["Main"]

    hit = client.event("stopped")
    assert hit["reason"] == "breakpoint" and hit["threadId"] == main and hit["allThreadsStopped"] is False, hit
    frames = stack(client, main)
    assert [(one["name"], one["line"]) for one in frames] == [("Counter", 14), ("Main", 23)], frames
    assert frames[0]["source"]["name"] == "steps.st", frames

    scope = client.ask("scopes", frameId=frames[0]["id"])["scopes"][0]
    values = {one["name"]: one for one in client.ask("variables", variablesReference=scope["variablesReference"])["variables"]}
    assert set(values) == {"n", "step"} and values["step"]["value"] == "1", values
    changed = client.ask("setVariable", variablesReference=scope["variablesReference"], name="n", value="1000")
    assert changed["value"] == "1000", changed
    client.ask("setVariable", expect=False, variablesReference=scope["variablesReference"], name="step", value="40000")
    assert client.ask("evaluate", expression="n", frameId=frames[0]["id"])["result"] == "1000"
    assert client.ask("evaluate", expression="step := 2", frameId=frames[0]["id"], context="repl")["result"] == "2"

    client.ask("stepOut", threadId=main)
    assert client.event("stopped")["reason"] == "step"
    assert stack(client, main)[0]["line"] == 24
    assert client.ask("evaluate", expression="Main.counter.n")["result"] == "1002"
    client.ask("evaluate", expression="Main.counter.step := 1", context="repl")  # as the next story expects it
    client.ask("stepIn", threadId=main)
    client.event("stopped")
    assert [one["name"] for one in stack(client, main)] == ["Twice", "Main"]
    client.ask("setBreakpoints", source={"path": "/engineer/src/steps.st"}, breakpoints=[])
    assert client.ask("continue", threadId=main)["allThreadsContinued"] is False

    client.ask("pause", threadId=threads["Other"])
    hit = client.event("stopped")
    assert hit["reason"] == "pause" and hit["threadId"] == threads["Other"], hit
    client.ask("next", threadId=threads["Other"])
    client.event("stopped")
    made = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "Twice"}, {"name": "Thrice"}])["breakpoints"]
    assert made[0]["verified"] and not made[1]["verified"], made
    client.event("stopped")
    client.ask("setFunctionBreakpoints", breakpoints=[])
    made = client.ask("setBreakpoints", source={"path": "/engineer/src/steps.st"}, breakpoints=[
        {"line": 14, "logMessage": "n is {n}", "hitCondition": "%2"}, {"line": 26, "hitCondition": ">=3"}])["breakpoints"]
    assert all(one["verified"] for one in made), made
    cycles = int(client.ask("evaluate", expression="Main.cycles")["result"])
    client.ask("continue", threadId=main)
    assert client.event("output")["output"].startswith("n is "), client.events
    assert client.event("stopped")["threadId"] == main and stack(client, main)[0]["line"] == 26
    assert int(client.ask("evaluate", expression="Main.cycles")["result"]) >= cycles + 2, "it halts at the third hit"
    client.ask("disconnect")


def garbage(port):
    for bytes_ in (b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"Content-Length: 99999999999\r\n\r\n", b"Content-Length: 3\r\n\r\n{}}",
                   b"\0" * 5000, b"Content-Length: 4\r\n\r\n[[]]",
                   b'Content-Length: 1000005\r\n\r\n{"a":' + b"[" * 500000 + b"]" * 499999 + b"}"):
        client = Client(port)
        client.socket.sendall(bytes_)
        try:
            while True:
                client.receive()
        except (EOFError, ConnectionError):
            pass


def launch_configuration(package):
    """That of the extension for VS Code, with each switch on. VS Code sends all of it as the arguments of its request."""
    with open(package, encoding="utf-8") as file:
        contributed = json.load(file)["contributes"]
    (debugger,) = contributed["debuggers"]
    (configuration,) = debugger["initialConfigurations"]
    assert debugger["configurationSnippets"][0]["body"] == configuration, debugger
    assert debugger["type"] == configuration["type"] == "plchost" and debugger["label"], debugger
    assert not {"program", "runtime"} & set(debugger), "the protocol is served by plcctl"
    assert {".st"} == {suffix for language in contributed["languages"] for suffix in language["extensions"]}, contributed
    assert debugger["languages"] == [one["language"] for one in contributed["breakpoints"]], contributed
    assert {one["id"] for one in contributed["languages"]} <= set(debugger["languages"]), contributed
    ((request, attributes),) = debugger["configurationAttributes"].items()
    assert configuration["request"] == request == "attach", configuration
    described = attributes["properties"]
    assert set(described) == {"debugServer", "haltAllTasks"} == set(configuration) - {"name", "type", "request"}, configuration
    assert all(configuration[name] == one["default"] for name, one in described.items()), configuration
    assert isinstance(configuration["debugServer"], int), "VS Code connects to a number only"
    return configuration | {name: True for name, one in described.items() if one["type"] == "boolean"}


def vscode(port, package):
    """A breakpoint halts all tasks."""
    client = attached(port, **launch_configuration(package))
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "Twice"}])
    halts = [client.event("stopped"), client.event("stopped")]
    assert sorted(one["reason"] for one in halts) == ["breakpoint", "pause"], halts
    client.ask("disconnect")


def text(port, source):
    """On the Structured Text of debugging_of_structured_text.sh."""
    client = attached(port)
    made = client.ask("setBreakpoints", source={"path": source}, breakpoints=[{"line": 11, "condition": "n > 3"}, {"line": 900}])["breakpoints"]
    assert made[0]["verified"] and made[0]["line"] == 12 and not made[1]["verified"], made
    client.ask("configurationDone")
    threads = {one["name"]: one["id"] for one in client.ask("threads")["threads"]}
    assert set(threads) == {"Main"}, threads
    main = threads["Main"]
    hit = client.event("stopped")
    assert hit["reason"] == "breakpoint" and hit["threadId"] == main, hit
    frames = stack(client, main)
    assert [(one["name"].lower(), one["line"]) for one in frames] == [("counter", 12), ("press", 19)], frames
    assert {one["source"]["path"] for one in frames} == {source}, frames  # an editor opens only a whole path

    scope = client.ask("scopes", frameId=frames[0]["id"])["scopes"][0]
    values = {one["name"].lower(): one for one in client.ask("variables", variablesReference=scope["variablesReference"])["variables"]}
    assert {"n", "inc"} <= set(values) and values["inc"]["value"] == "1", values
    changed = client.ask("setVariable", variablesReference=scope["variablesReference"], name=values["n"]["name"], value="1000")
    assert changed["value"] == "1000", changed
    assert client.ask("evaluate", expression="n", frameId=frames[0]["id"])["result"] == "1000"

    client.ask("stepOut", threadId=main)
    assert client.event("stopped")["reason"] == "step"
    frames = stack(client, main)
    assert [(one["name"].lower(), one["line"]) for one in frames] == [("press", 20)], frames
    assert client.ask("evaluate", expression="press1.one.n")["result"] == "1001"
    client.ask("stepIn", threadId=main)
    client.event("stopped")
    frames = stack(client, main)
    assert [one["name"].lower() for one in frames] == ["twice", "press"]
    scope, globals_ = client.ask("scopes", frameId=frames[0]["id"])["scopes"]
    locals_ = {one["name"].lower(): one["value"] for one in client.ask("variables", variablesReference=scope["variablesReference"])["variables"]}
    assert scope["name"] == "Locals" and locals_ == {"x": "1001", "twice": "0"}, (scope, locals_)
    changed = client.ask("setVariable", variablesReference=scope["variablesReference"], name="x", value="1002")
    assert changed["value"] == "1002", changed
    client.ask("setVariable", expect=False, variablesReference=scope["variablesReference"], name="x", value="40000")
    assert client.ask("evaluate", expression="x", frameId=frames[0]["id"])["result"] == "1002"
    assert globals_["name"] == "Globals", globals_
    shown = client.ask("variables", variablesReference=globals_["variablesReference"])["variables"]
    assert [(one["name"].lower(), one["value"]) for one in shown] == [("most", "20000")], shown
    client.ask("stepOut", threadId=main)
    client.event("stopped")
    client.ask("next", threadId=main)
    client.event("stopped")
    assert client.ask("evaluate", expression="press1.doubled")["result"] == "2004"
    array = client.ask("evaluate", expression="press1.last")
    shown = client.ask("variables", variablesReference=array["variablesReference"])["variables"]
    assert [one["name"] for one in shown] == ["[1]", "[2]", "[3]"], shown
    changed = client.ask("setVariable", variablesReference=array["variablesReference"], name="[3]", value="33")
    assert changed["value"] == "33", changed

    assert client.ask("continue", threadId=main)["allThreadsContinued"] is False
    hit = client.event("stopped")
    assert hit["reason"] == "breakpoint" and hit["threadId"] == main, hit
    frames = stack(client, main)
    assert [(one["name"].lower(), one["line"]) for one in frames] == [("counter", 12), ("press", 19)], frames
    assert client.ask("evaluate", expression="n", frameId=frames[0]["id"])["result"] == "1001", "the cycle has not gone on"
    client.ask("setBreakpoints", source={"path": source}, breakpoints=[])
    assert client.ask("continue", threadId=main)["allThreadsContinued"] is False
    client.ask("stepIn", expect=False, threadId=main)  # it runs
    client.ask("disconnect")


def second(port):
    """Beside a client, and beside a connection that sends nothing."""
    first = attached(port)
    refused(port)
    assert first.ask("threads")["threads"], "the first one is served as before"
    first.ask("disconnect")
    silent = Client(port)
    refused(port)
    left = silent.event("output")
    assert "no request for 5 s" in left["output"], left
    silent.event("terminated")
    attached(port).ask("disconnect")


def refused(port):
    client = Client(port)
    client.socket.sendall(b"Content-Length: 2\r\n\r\n{}")
    told = client.event("output")
    assert "another client is connected" in told["output"], told
    client.event("terminated")
    try:
        assert not client.receive()
    except EOFError:
        client.socket.close()


def vanish(port):
    client = attached(port)
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "Main"}])
    client.event("stopped")
    client.socket.close()


{"story": story, "garbage": garbage, "vanish": vanish, "second": second, "vscode": vscode, "text": text}[sys.argv[2]](int(sys.argv[1]), *sys.argv[3:])
