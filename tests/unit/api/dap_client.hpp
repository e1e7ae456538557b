#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/cli/debug/dap_session.hpp"
#include "tests/unit/api/debugged_instance.hpp"

namespace plchost {

/// A client of the Debug Adapter Protocol, attached to an instance with a halted task.
class DapSessionTest : public testing::Test {
 protected:
  using json = nlohmann::json;
  static constexpr int kInnermost = 1000;  ///< frames of the first thread
  static constexpr int kCaller = 1002;

  DapSessionTest() {
    instance_.variables = {variable_record("Main.n", "INT", "1"), variable_record("Main.c.n", "INT", "2"),
                           variable_record("Main.c.text", "STRING", "'on'"),
                           variable_record("Main.c.t[]", "ARRAY [1..2] OF INT", "[3, 4]")};
    instance_.halt("fast", 1,
                   json::array({{{"pou", "Counter"}, {"line", 9}, {"file", "a.st"}, {"instance", "Main.c"}},
                                {{"pou", "Twice"},
                                 {"line", 3},
                                 {"file", "a.st"},
                                 {"locals", json::array({{{"name", "n"}, {"type", "INT"}, {"value", "3"}}})}},
                                {{"pou", "Main"}, {"line", 20}, {"file", "a.st"}, {"instance", "Main"}}}));
    (void)ask("attach");
  }

  json answer(const std::string& command, const json& arguments = json::object()) {
    sent_.clear();
    EXPECT_TRUE(sut_.obey({{"seq", 1}, {"command", command}, {"arguments", arguments}}));
    for (const json& message : sent_) {
      if (message["type"] == "response") return message;
    }
    return {};
  }
  json ask(const std::string& command, const json& arguments = json::object()) {
    const json response = answer(command, arguments);
    EXPECT_TRUE(response["success"]) << response;
    return response["body"];
  }
  // "NAME=VALUE" of each.
  std::vector<std::string> shown(int reference) {
    std::vector<std::string> all;
    const json body = ask("variables", {{"variablesReference", reference}});
    for (const json& one : body["variables"])
      all.push_back(fmt::format("{}={}", one["name"].get<std::string>(), one["value"].get<std::string>()));
    return all;
  }
  std::string result(const std::string& expression, const std::string& context) {
    return ask("evaluate",
               {{"expression", expression}, {"frameId", kInnermost}, {"context", context}})["result"];
  }

  DebuggedInstance instance_;
  DebugLink link_{instance_.requests(), "cell", "line1"};
  std::vector<json> sent_;
  DapSession sut_{link_, [this](const json& message) { sent_.push_back(message); }, false};
};

}  // namespace plchost
