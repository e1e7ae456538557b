#!/usr/bin/env python3
"""A simulated terminal of the packing line: a device on Modbus TCP.

It obeys lines of its standard input, and ends with it: `stop 1`, `enable 1`, `acknowledge 1`, `speed 300`. It prints its port,
and then a line each time that its outputs change.
"""
import argparse
import socketserver
import struct
import sys
import threading

INPUTS = ["stop", "enable", "acknowledge"]  # discrete inputs 0 to 2
COILS = ["motor", "fault", "carton"]  # coils 0 to 2
REGISTERS = ["speed", "products", "cartons", "stops", "refused"]  # holding registers 0 to 4
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


class Refused(Exception):
    """An exception of Modbus."""


class Terminal:
    """Values of the device. All functions may be called on any thread."""

    def __init__(self):
        self.lock = threading.Lock()
        self.inputs = [0] * len(INPUTS)
        self.wanted = [0]  # input register 0
        self.coils = [0] * len(COILS)
        self.registers = [0] * len(REGISTERS)

    def obey(self, line):
        word, value = line.split()
        with self.lock:
            if word == "speed":
                self.wanted[0] = int(value) & 0xFFFF
            else:
                self.inputs[INPUTS.index(word)] = 1 if int(value) else 0

    def shown(self):
        return ", ".join(f"{name} {value}" for name, value in zip(COILS + REGISTERS, self.coils + self.registers))

    def answer(self, request):
        """The answer to a request, both without their head."""
        with self.lock:
            before = self.shown()
            try:
                answer = self.answer_function(request[0], request[1:])
            except (struct.error, IndexError):
                raise Refused(ILLEGAL_VALUE) from None
            if self.shown() != before:
                print(self.shown(), flush=True)
            return bytes([request[0]]) + answer

    def answer_function(self, function, data):
        bits = {1: self.coils, 2: self.inputs}
        words = {3: self.registers, 4: self.wanted}
        first, count = struct.unpack(">HH", data[:4])
        if function in bits:
            values = part_of(bits[function], first, count)
            packed = sum(value << i for i, value in enumerate(values)).to_bytes((count + 7) // 8, "little")
            return bytes([len(packed)]) + packed
        if function in words:
            values = part_of(words[function], first, count)
            return struct.pack(f">B{count}H", 2 * count, *values)
        if function in (5, 6):  # one value, which stands where the others have their count
            target = self.coils if function == 5 else self.registers
            part_of(target, first, 1)
            target[first] = int(count == 0xFF00) if function == 5 else count
        elif function == 15:
            part_of(self.coils, first, count)
            packed = int.from_bytes(data[5 : 5 + (count + 7) // 8], "little")
            self.coils[first : first + count] = [packed >> i & 1 for i in range(count)]
        elif function == 16:
            part_of(self.registers, first, count)
            self.registers[first : first + count] = struct.unpack(f">{count}H", data[5 : 5 + 2 * count])
        else:
            raise Refused(ILLEGAL_FUNCTION)
        return data[:4]


def part_of(values, first, count):
    if count < 1 or first + count > len(values):
        raise Refused(ILLEGAL_ADDRESS)
    return values[first : first + count]


class Connection(socketserver.StreamRequestHandler):
    def handle(self):
        while len(head := self.rfile.read(7)) == 7:
            number, protocol, size, unit = struct.unpack(">HHHB", head)
            if protocol != 0 or not 2 <= size <= 254:
                return  # no Modbus
            request = self.rfile.read(size - 1)
            if len(request) < size - 1:
                return
            try:
                answer = self.server.terminal.answer(request)
            except Refused as error:
                answer = bytes([request[0] | 0x80, error.args[0]])
            self.wfile.write(struct.pack(">HHHB", number, 0, len(answer) + 1, unit) + answer)


class Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True


def main():
    parser = argparse.ArgumentParser(description="a simulated terminal of the packing line")
    parser.add_argument("--port", type=int, default=1502, help="of 127.0.0.1; 0: any that is free (default 1502)")
    arguments = parser.parse_args()
    with Server(("127.0.0.1", arguments.port), Connection) as server:
        server.terminal = Terminal()
        threading.Thread(target=server.serve_forever, daemon=True).start()
        print(server.server_address[1], flush=True)
        for line in sys.stdin:
            try:
                server.terminal.obey(line)
            except ValueError:
                print(f"write one of {', '.join(INPUTS)}, speed, and a number", flush=True)
        server.shutdown()


main()
