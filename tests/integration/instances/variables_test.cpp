// The variables of an application are seen, written and forced while a real plc-instance runs it.
#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/instance_process.hpp"
#include "tests/integration/instances/value_client.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Variables : public ::testing::Test {
 protected:
  explicit Variables(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"--application", application("seen")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    process_ = std::make_unique<InstanceProcess>(sandbox_, arguments);
    process_->wait_until_up(more.empty());
    client_ = std::make_unique<ValueClient>(sandbox_);
  }

  ControlReply write(const std::string& argument) {
    return process_->ask(ControlVerb::write_variable, argument);
  }
  ControlReply force(const std::string& argument) {
    return process_->ask(ControlVerb::force_variable, argument);
  }
  ControlReply unforce(const std::string& argument) {
    return process_->ask(ControlVerb::unforce_variable, argument);
  }
  std::string read(const std::string& name) { return client_->read(name); }
  bool soon(const std::string& name, const std::string& value) {
    return eventually([&] { return read(name) == value; });
  }

  Sandbox sandbox_;
  std::unique_ptr<InstanceProcess> process_;
  std::unique_ptr<ValueClient> client_;
};

TEST_F(Variables, OfEachTypeAreRead) {
  EXPECT_EQ(client_->table().symbols().size(), 30);
  EXPECT_EQ(process_->runtime().variables, 30);
  EXPECT_EQ(process_->runtime().forces, 0);
  const auto elements =
      client_->elements({"main.FLAG", "Main.real", "Main.lreal", "Main.pause", "Main.text", "Grid[1,2]",
                         "Grid[0][0]", "Main.serial", "Main.status", "Line.pressure[1]", "Line.pressure[3]",
                         "Line.label", "Main.letter", "Main.sign", "Line.title", "Line.units[2]"});
  // An answer that finds no moment between the cycles says so.
  ValueReply reply;
  ASSERT_TRUE(eventually([&] {
    reply = client_->ask(elements);
    return reply.consistent;
  }));
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_THAT(client_->texts(reply),
              ElementsAre("TRUE", "1.5", "-2.0", "T#1s500ms", "'hello'", "6", "1", "4711", "16#00FF", "7",
                          "9", "'press'", "'a'", "\"\u20ac\"", "\"gr\u00fc\u00df\"", "\"\u00b5m\""));
  EXPECT_GT(reply.time_monotonic_ns, 0);
  EXPECT_GT(reply.time_unix_ns, 0);
  const auto& table = client_->table();
  const auto type = [&](const char* name) { return type_text(table.symbols()[table.find(name)->symbol]); };
  EXPECT_EQ(type("Line.temperature[1]"), "ARRAY [1..10] OF REAL");
  EXPECT_EQ(type("Main.letter"), "CHAR");
  EXPECT_EQ(type("Main.sign"), "WCHAR");
  EXPECT_EQ(type("Line.title"), "WSTRING[7]");
  EXPECT_EQ(type("Line.units[1]"), "ARRAY [1..2] OF WSTRING[3]");
  const VariableSymbol& input = table.symbols()[table.find("Main.input")->symbol];
  EXPECT_EQ(input.task, "Main");
  EXPECT_EQ(input.area, "%IW0");
  EXPECT_TRUE(table.symbols()[table.find("Main.serial")->symbol].read_only);
}

TEST_F(Variables, AreSeenWhileTheyChange) {
  const auto count = client_->elements({"Main.count"});
  const std::string before = client_->texts(client_->ask(count)).at(0);
  EXPECT_TRUE(eventually([&] { return client_->texts(client_->ask(count)).at(0) != before; }));
}

TEST_F(Variables, AWriteTakesEffectOnce) {
  EXPECT_EQ(write("Main.written=5").code, ErrorCode::ok);
  EXPECT_TRUE(soon("Main.taken", "5"));
  EXPECT_EQ(write("Main.written=16#10").code, ErrorCode::ok);
  EXPECT_TRUE(soon("Main.taken", "21"));
  EXPECT_EQ(read("Main.written"), "0");
  EXPECT_EQ(read("Main.taken"), "21");
  EXPECT_EQ(write("main.text='it$'s'").text, "'Main.text' is written: 'hello' -> 'it$'s'");
  EXPECT_EQ(read("Main.text"), "'it$'s'");
  EXPECT_EQ(write("Line.temperature[10]=-1.5").code, ErrorCode::ok);
  EXPECT_EQ(read("Line.temperature[10]"), "-1.5");
  EXPECT_EQ(read("Line.temperature[9]"), "0.0");
  EXPECT_THAT(process_->log(), HasSubstr("variable 'Main.text' is written\n"));
}

TEST_F(Variables, AForceHoldsAtBothEdgesOfEachCycle) {
  EXPECT_TRUE(soon("Main.at_begin", "8"));
  EXPECT_TRUE(soon("Main.behind_call", "7"));
  EXPECT_EQ(force("Main.forced=5").code, ErrorCode::ok);
  EXPECT_EQ(process_->runtime().forces, 1);
  EXPECT_TRUE(soon("Main.at_begin", "5"));
  const auto all = client_->elements({"Main.forced", "Main.at_begin", "Main.behind_call"});
  for (int i = 0; i < 200; ++i) {
    const ValueReply reply = client_->ask(all);
    EXPECT_THAT(reply.forced, ElementsAre(1, 0, 0));
    if (reply.consistent) {
      EXPECT_THAT(client_->texts(reply), ElementsAre("5", "5", "5"));
    }
  }
  const ValueReply forced = client_->ask({}, ValueKind::forced);
  EXPECT_EQ(forced.elements, client_->elements({"Main.forced"}));
  EXPECT_THAT(client_->texts(forced), ElementsAre("5"));
  EXPECT_EQ(force("Main.forced=6").code, ErrorCode::ok);
  EXPECT_TRUE(soon("Main.at_begin", "6"));
  EXPECT_EQ(unforce("Main.forced").text, "forces end: Main.forced");
  EXPECT_TRUE(soon("Main.at_begin", "8"));
  EXPECT_EQ(process_->runtime().forces, 0);
}

TEST_F(Variables, AnOutputFollowsAForcedInput) {
  EXPECT_TRUE(soon("Main.output", "3"));
  EXPECT_EQ(force("Main.input=9").code, ErrorCode::ok);
  EXPECT_TRUE(soon("Main.output", "9"));
  EXPECT_THAT(write("Main.input=4").text, HasSubstr("it is forced to 9"));
  EXPECT_TRUE(soon("Main.input", "9"));
  EXPECT_EQ(force("Grid[0,1]=77").code, ErrorCode::ok);
  EXPECT_EQ(process_->runtime().forces, 2);
  EXPECT_EQ(unforce("*").code, ErrorCode::ok);
  EXPECT_TRUE(soon("Main.output", "3"));
  EXPECT_EQ(read("Grid[0,1]"), "77");  // the code does not write it
  EXPECT_EQ(unforce("*").text, "no variable was forced");
}

TEST_F(Variables, OtherOrdersAreRefused) {
  const auto refused = [](const ControlReply& reply, ErrorCode code, std::string_view text) {
    EXPECT_EQ(reply.code, code) << reply.text;
    EXPECT_THAT(reply.text, HasSubstr(text));
  };
  refused(write("Main.serial=1"), ErrorCode::refused,
          "'Main.serial': the application has declared it as read-only");
  refused(force("Main.serial=1"), ErrorCode::refused, "read-only");
  refused(write("Main.written=x"), ErrorCode::invalid_argument,
          "'x' is no DINT; allowed is -2147483648 to 2147483647");
  refused(write("Main.writen=1"), ErrorCode::not_found, "did you mean 'Main.written'?");
  refused(write("Grid=1"), ErrorCode::invalid_argument, "name an element, as Grid[0,0]");
  refused(write("Grid[2,0]=1"), ErrorCode::invalid_argument, "allowed as index 1 are 0 to 1");
  refused(write("Main.written"), ErrorCode::invalid_argument, "NAME=VALUE is, as Main.speed=5");
  refused(write("=5"), ErrorCode::invalid_argument, "NAME=VALUE");
  refused(unforce("Main.forced"), ErrorCode::wrong_state, "'Main.forced' is not forced");
  refused(unforce("Nobody"), ErrorCode::not_found, "no variable 'Nobody'");
  refused(write("Main.text=longer than it"), ErrorCode::invalid_argument, "a text of at most 10 bytes");
}

TEST_F(Variables, RequestsForAnotherTableAreRefused) {
  const auto element = client_->elements({"Main.count"});
  const auto code = [&](const ValueRequest& request) {
    EXPECT_TRUE(client_->socket().send(encode(request)));
    const auto reply = client_->receive();
    return reply ? reply->code : ErrorCode::unavailable;
  };
  EXPECT_EQ(code({.number = 1, .stream = 1, .elements = element}), ErrorCode::wrong_state);
  const std::uint64_t stream = client_->table().stream();
  EXPECT_EQ(code({.number = 1, .stream = stream, .elements = {{.symbol = 99, .element = 0}}}),
            ErrorCode::not_found);
  EXPECT_EQ(code({.number = 1, .stream = stream, .elements = {{.symbol = 0, .element = 6}}}),
            ErrorCode::not_found);
  EXPECT_EQ(code({.number = 1, .stream = stream, .elements = element}), ErrorCode::ok);
}

TEST_F(Variables, PacketsOfAStrangerEndHisConnectionOnly) {
  for (const std::string& packet :
       {std::string("x"), std::string(kMaxPacket, '\xff'), std::string(100, '\0')}) {
    auto stranger = PacketSocket::connect(values_socket_path(sandbox_.folder(), "line1")).value();
    ASSERT_TRUE(stranger.send(packet));
    const auto answer = receive_until(stranger, MonotonicClock::now() + std::chrono::seconds(20));
    ASSERT_TRUE(answer) << answer.error().describe();
    EXPECT_EQ(ValueReplyReader().take(*answer).value()->code, ErrorCode::corrupt);
    EXPECT_EQ(receive_until(stranger, MonotonicClock::now() + std::chrono::seconds(20)).error().code,
              ErrorCode::unavailable);
  }
  EXPECT_EQ(read("Main.serial"), "4711");
}

TEST_F(Variables, ThereIsABoundOfConnections) {
  constexpr int kMost = 8;
  const auto answer = [](PacketSocket& socket) {
    const auto packet = receive_until(socket, MonotonicClock::now() + std::chrono::seconds(20));
    return packet ? ValueReplyReader().take(*packet).value()->code : ErrorCode::unavailable;
  };
  std::vector<PacketSocket> all;
  for (int i = 1; i < kMost; ++i) {  // and the client
    all.push_back(PacketSocket::connect(values_socket_path(sandbox_.folder(), "line1")).value());
    ASSERT_TRUE(all.back().send(encode(ValueRequest{
        .number = 1, .stream = client_->table().stream(), .kind = ValueKind::forced, .elements = {}})));
    EXPECT_EQ(answer(all.back()), ErrorCode::ok);
  }
  auto one_more = PacketSocket::connect(values_socket_path(sandbox_.folder(), "line1")).value();
  EXPECT_EQ(answer(one_more), ErrorCode::busy) << "it comes unasked";
  EXPECT_EQ(read("Main.serial"), "4711");
}

TEST_F(Variables, AClientThatDoesNotReadIsDropped) {
  ValueClient lazy(sandbox_);
  // 1024 values in each: a socket holds the answers of some of them.
  const std::vector<VariableElement> many(kMaxRequestedValues, lazy.elements({"Main.text"}).front());
  const bool dropped = eventually([&] {
    const auto sent = lazy.socket().send(
        encode(ValueRequest{.number = 1, .stream = lazy.table().stream(), .elements = many}));
    return !sent && sent.error().code == ErrorCode::unavailable;
  });
  EXPECT_TRUE(dropped);
  EXPECT_EQ(read("Main.serial"), "4711");
}

TEST_F(Variables, AsManyValuesAsARequestMayHave) {
  const std::vector<VariableElement> many(kMaxRequestedValues, client_->elements({"Main.text"}).front());
  const ValueReply reply = client_->ask(many);
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_EQ(reply.values.size(), kMaxRequestedValues * 11);
}

TEST_F(Variables, OfAnApplicationInExceptionAreReadOnly) {
  EXPECT_EQ(force("Main.input=4").code, ErrorCode::ok);
  EXPECT_EQ(write("Main.crash=TRUE").code, ErrorCode::ok);
  EXPECT_TRUE(eventually([&] { return process_->runtime().state == ApplicationState::exception; }));
  const ValueReply reply = client_->ask(client_->elements({"Main.crash"}));
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_THAT(client_->texts(reply), ElementsAre("TRUE"));
  EXPECT_EQ(write("Main.crash=FALSE").code, ErrorCode::wrong_state);
  EXPECT_EQ(process_->end(SIGTERM), 0);
  EXPECT_THAT(process_->log(), HasSubstr("1 force ended, because the process ends: Main.input"));
}

// Its thread never goes on, so nothing of it has to be waited for.
TEST(VariablesBesideATaskInException, AreReadWrittenAndForced) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--application", application("seen"), "--settings",
                                sandbox.write("line1.cfg", "[Task.Main]\nWatchdog.Policy=Task\n")});
  sut.wait_until_up();
  ValueClient client(sandbox);
  ASSERT_EQ(sut.ask(ControlVerb::write_variable, "Main.crash=TRUE").code, ErrorCode::ok);
  ASSERT_TRUE(eventually([&] { return sut.task("Main")->state == PageTaskState::exception; }));
  EXPECT_EQ(sut.runtime().state, ApplicationState::running);
  EXPECT_EQ(sut.ask(ControlVerb::write_variable, "Line.temperature[10]=-1.5").code, ErrorCode::ok);
  EXPECT_EQ(client.read("Line.temperature[10]"), "-1.5");
  EXPECT_EQ(sut.ask(ControlVerb::force_variable, "Main.input=4").code, ErrorCode::ok);
  EXPECT_EQ(client.read("Main.input"), "4");
  EXPECT_TRUE(client.ask(client.elements({"Main.crash", "Main.input"})).consistent);
  EXPECT_EQ(sut.ask(ControlVerb::unforce_variable, "*").code, ErrorCode::ok);
  EXPECT_EQ(sut.ask(ControlVerb::change_application, application("seen")).code, ErrorCode::wrong_state);
  EXPECT_EQ(sut.end(SIGTERM), 0);
}

class StoppedVariables : public Variables {
 protected:
  StoppedVariables() : Variables({"--stopped"}) {}
};

TEST_F(StoppedVariables, AreReadWrittenAndForced) {
  EXPECT_EQ(read("Main.count"), "0");
  EXPECT_EQ(write("Main.input=5").code, ErrorCode::ok);
  EXPECT_EQ(read("Main.input"), "5");
  EXPECT_EQ(force("Main.input=6").code, ErrorCode::ok);
  EXPECT_EQ(read("Main.input"), "6");
  EXPECT_EQ(process_->ask(ControlVerb::single_cycle).code, ErrorCode::ok);
  EXPECT_EQ(read("Main.output"), "6");
  EXPECT_EQ(read("Main.count"), "1");
}

TEST_F(Variables, ForcesGoOnInAnOnlineChange) {
  EXPECT_EQ(force("Main.input=9").code, ErrorCode::ok);
  EXPECT_EQ(force("Grid[1,1]=50").code, ErrorCode::ok);
  EXPECT_EQ(force("Main.changed=5").code, ErrorCode::ok);
  const auto old = client_->elements({"Main.count"});
  const ControlReply changed = process_->ask(ControlVerb::change_application, application("seen_2"));
  EXPECT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_THAT(changed.text, HasSubstr("1 force ended, of variables that are not the same: Main.changed"));
  EXPECT_EQ(client_->ask(old).code, ErrorCode::wrong_state);
  client_->open_table();
  EXPECT_EQ(read("Main.version"), "2");
  EXPECT_TRUE(soon("Main.output", "9"));
  EXPECT_EQ(read("Grid[1,1]"), "50");
  EXPECT_EQ(read("Main.changed"), "2");
  EXPECT_EQ(process_->runtime().forces, 2);
  EXPECT_EQ(unforce("Main.input").code, ErrorCode::ok);
  EXPECT_TRUE(soon("Main.output", "3"));
}

TEST(VariablesOfCharacters, AreReadWrittenAndForced) {
  const Sandbox sandbox;
  InstanceProcess process(sandbox, {"--application", application("characters")});
  process.wait_until_up();
  ValueClient client(sandbox);
  const auto write = [&](const std::string& text) { return process.ask(ControlVerb::write_variable, text); };
  const auto soon = [&](const std::string& name, const std::string& value) {
    return eventually([&] { return client.read(name) == value; });
  };
  EXPECT_EQ(client.read("letter"), "'a'");
  EXPECT_EQ(client.read("odd"), "'$FF'");
  EXPECT_EQ(client.read("sign"), "\"\u20ac\"");
  EXPECT_EQ(client.read("half"), "\"$D83D\"");
  EXPECT_EQ(client.read("letters[1]"), "\"r\"");
  EXPECT_EQ(client.read("names[2]"), "\"two\"");
  EXPECT_EQ(client.read("full"), "\"xyz\"") << "its memory ends it";
  EXPECT_TRUE(soon("copy", "\"press\""));
  EXPECT_EQ(write("title=\"\U0001f600$D83D $\"\"").text,
            "'title' is written: \"press\" -> \"\U0001f600$D83D $\"\"");
  EXPECT_TRUE(soon("copy", "\"\U0001f600$D83D $\"\""));
  EXPECT_EQ(client.read("letters[7]"), "\"$0000\"");
  EXPECT_EQ(write("full=ab").code, ErrorCode::ok);
  EXPECT_EQ(client.read("full"), "\"ab\"");
  EXPECT_THAT(write("full=abc").text, HasSubstr("a text of at most 2 units of UTF-16; this one has 3"));
  EXPECT_EQ(write("names[1]=\"\u00e4\"").code, ErrorCode::ok);
  EXPECT_EQ(client.read("names[1]"), "\"\u00e4\"");
  EXPECT_EQ(client.read("names[2]"), "\"two\"");
  EXPECT_THAT(write("letter=b").text, HasSubstr("'b' is no CHAR; allowed is one byte, as 'x' or '$41'"));
  EXPECT_EQ(write("letter='$''").code, ErrorCode::ok);
  EXPECT_EQ(client.read("letter"), "'$''");
  EXPECT_EQ(process.ask(ControlVerb::force_variable, "copy=forced").code, ErrorCode::ok);
  EXPECT_TRUE(soon("same", "0"));
  EXPECT_EQ(client.read("copy"), "\"forced\"");
  EXPECT_EQ(write("title=forced").code, ErrorCode::ok);
  EXPECT_TRUE(soon("same", "1"));
}

TEST(VariablesOfNoApplication, AreNone) {
  const Sandbox sandbox;
  InstanceProcess process(sandbox, {});
  process.wait_until_up(false);
  ValueClient client(sandbox);
  EXPECT_TRUE(client.table().symbols().empty());
  EXPECT_EQ(client.ask({}).code, ErrorCode::wrong_state);
  EXPECT_EQ(process.ask(ControlVerb::write_variable, "a=1").code, ErrorCode::wrong_state);
  EXPECT_EQ(process.end(SIGTERM), 0);
  EXPECT_EQ(SymbolTable::open(sandbox.pool(), "line1").error().code, ErrorCode::not_found);
}

TEST(VariablesThatAreRefused, AreNamed) {
  const auto refusal = [](const std::string& name) {
    const Sandbox sandbox;
    InstanceProcess process(sandbox, {"--application", application(name)});
    const int code = process.end();
    return fmt::format("{} {}", code, process.log());
  };
  EXPECT_THAT(
      refusal("bad_variable_address"),
      HasSubstr(
          "variable 'Main.there': pAddress 0x10: its 2 bytes are not memory of this process that can be "
          "read and written"));
  EXPECT_THAT(refusal("bad_variable_constant"), HasSubstr("that can be read and written"));
  EXPECT_THAT(refusal("bad_variable_task"),
              HasSubstr("variable 'Main.there': there is no task 'Mian'; there are Main"));
  const Sandbox sandbox;
  InstanceProcess twice(sandbox, {"--application", application("bad_variable_twice")});
  twice.wait_until_up();
  EXPECT_THAT(twice.log(), HasSubstr("variable 'MAIN.THERE' is declared twice"));
  EXPECT_EQ(twice.runtime().variables, 1);
}

/// Two variables that a task always changes together, under each scheduler.
class Samples : public ::testing::TestWithParam<std::string> {};

TEST_P(Samples, AreNeverTorn) {
  constexpr int kSamples = 3400;
  const Sandbox sandbox;
  InstanceProcess process(sandbox, {"--application", application("seen"), "--scheduler", GetParam()});
  process.wait_until_up();
  ValueClient client(sandbox);
  const auto all = client.elements({"Fast.first", "Fast.second", "Slow.first", "Slow.second"});
  int consistent = 0;
  int asked = 0;
  std::string first;
  std::string last;
  for (; consistent < kSamples && asked < 2 * kSamples; ++asked) {
    const ValueReply reply = client.ask(all);
    ASSERT_EQ(reply.code, ErrorCode::ok);
    if (!reply.consistent) continue;
    ++consistent;
    const auto texts = client.texts(reply);
    ASSERT_EQ(texts[0], texts[1]) << "of a task that nobody interrupts, sample " << asked;
    ASSERT_EQ(texts[2], texts[3]) << "of a task that others interrupt, sample " << asked;
    if (first.empty()) first = texts[2];
    last = texts[2];
  }
  EXPECT_EQ(consistent, kSamples) << asked;
  EXPECT_NE(first, last) << "the task has not run";
}

INSTANTIATE_TEST_SUITE_P(Schedulers, Samples,
                         ::testing::Values("CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot"),
                         [](const auto& parameter) { return parameter.param; });

}  // namespace
}  // namespace plchost::testing
