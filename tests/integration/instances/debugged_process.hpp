#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "shm/pages/debug_page.hpp"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/integration/instances/value_client.hpp"

namespace plchost::testing {

/// A plc-instance with a debug build, and the commands of its debugger.
class Debugging : public ::testing::Test {
 protected:
  using json = nlohmann::json;

  void start(const std::string& program, std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--application", program});
    process_ = std::make_unique<InstanceProcess>(sandbox_, more);
    process_->wait_until_up(true);
    values_ = std::make_unique<ValueClient>(sandbox_);
  }

  ControlReply debug(const std::string& command) { return process_->ask(ControlVerb::debug, command); }
  void attach() {
    const ControlReply reply = debug("attach");
    ASSERT_EQ(reply.code, ErrorCode::ok) << reply.text;
    session_ = json::parse(reply.text).value("session", std::uint64_t{0});
  }
  /// A command of the session that succeeds; its answer.
  json command(const std::string& text) {
    const ControlReply reply = debug(fmt::format("{} {}", session_, text));
    EXPECT_EQ(reply.code, ErrorCode::ok) << text << ": " << reply.text;
    return json::parse(reply.text, nullptr, false);
  }
  std::string refused(const std::string& text) {
    const ControlReply reply = debug(fmt::format("{} {}", session_, text));
    EXPECT_NE(reply.code, ErrorCode::ok) << text;
    return reply.text;
  }

  json state() {
    for (int asked = 0; asked < 10'000; ++asked) {
      const auto part = read_debug_part(sandbox_.pool(), "line1", {.session = session_});
      if (part) return json::parse(part->text);  // else it is being written
    }
    ADD_FAILURE() << "no state of the debugger";
    return {};
  }
  json task(const std::string& name) {
    const json now = state();
    for (const json& one : now["tasks"]) {
      if (one["task"] == name) return one;
    }
    return {};
  }
  bool halts(const std::string& name) {
    return eventually([&] { return task(name).value("state", "") == "halted"; });
  }
  /// "Counter:14 Main:23", from the statement outwards.
  std::string stack(const std::string& name) {
    std::string text;
    const json found = task(name);
    for (const json& frame : found.value("stack", json::array())) {
      text += fmt::format("{}{}:{}", text.empty() ? "" : " ", frame.value("pou", ""), frame.value("line", 0));
    }
    return text;
  }
  /// Goes on by that command, and halts there.
  std::string stack_after(const std::string& verb) {
    const int before = task("Main").value("halts", 0);
    command(verb + " Main");
    // The halt is counted a moment before its stack can be seen.
    EXPECT_TRUE(eventually([&] {
      const json now = task("Main");
      return now.value("halts", 0) == before + 1 && !now.value("stack", json::array()).empty();
    })) << state().dump(2);
    return stack("Main");
  }
  std::uint64_t cycles(const std::string& name) { return process_->task(name)->counters.cycles; }
  std::uint64_t lost(const std::string& name) { return process_->task(name)->counters.lost_cycles; }
  bool goes_on(const std::string& name) {
    const auto before = cycles(name);
    return eventually([&] { return cycles(name) > before + 1; });
  }

  Sandbox sandbox_;
  std::unique_ptr<InstanceProcess> process_;
  std::unique_ptr<ValueClient> values_;
  std::uint64_t session_ = 0;
};

}  // namespace plchost::testing
