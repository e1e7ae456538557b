// The state of a debugger comes over DDS in one page.
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <unistd.h>

#include "shm/pages/debug_page.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class StateOfADebugger : public testing::Test {
 protected:
  StateOfADebugger() {
    host_.write_instance(0, "line1", InstanceState::running, ::getpid());
    host_.write_instance(1, "line2", InstanceState::running, ::getpid());
    host_.write_count(2);
    host_.start_server();
    client_ = connect(domain_);
    EXPECT_TRUE(client_->host("hosta", soon()));
    EXPECT_EQ(client_->instances("hosta", soon()).value().size(), 2U);
  }
  ~StateOfADebugger() override { DebugPage::remove(host_.pool_name(), "line1"); }

  Result<DebugPart> read(const std::string& instance, DebugQuery query) {
    return client_->read_debug("hosta", instance, query, soon());
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  DebugPage page_ = DebugPage::create(host_.pool_name(), "line1").value();
  std::unique_ptr<ControlClient> client_;
};

TEST_F(StateOfADebugger, ComesWholeAlsoIfItIsLong) {
  for (const std::size_t size : {std::size_t{60'000}, kMaxDebugState}) {
    std::string state;
    while (state.size() < size) state += static_cast<char>('a' + state.size() % 23);
    page_.write(state);
    const auto part = read("line1", {});
    ASSERT_TRUE(part) << part.error().describe();
    EXPECT_EQ(part->text, state);
    EXPECT_EQ(part->size, size);
  }
  const auto rest = read("line1", {.offset = kMaxDebugState - 5});
  ASSERT_TRUE(rest) << rest.error().describe();
  EXPECT_EQ(rest->text.size(), 5U);
  EXPECT_EQ(rest->offset, kMaxDebugState - 5);
}

TEST_F(StateOfADebugger, TellsTheInstanceWhoHasAsked) {
  page_.write("{}");
  ASSERT_TRUE(read("line1", {}));
  EXPECT_EQ(page_.asked().session, 0U);
  ASSERT_TRUE(read("line1", {.session = 7}));
  EXPECT_EQ(page_.asked().session, 7U);
}

TEST_F(StateOfADebugger, IsRefusedIfItIsNone) {
  host_.answer_with({.text = R"({"session":1})"});
  page_.write(R"({"session":1,"tasks":[]})");
  const std::vector<std::string> look{"debug", "line1", "tasks"};
  const auto good = run_plcctl(domain_.number(), look);
  EXPECT_EQ(good.code, 0) << good.errors;
  page_.write(R"({"session":1,"tasks":)" + std::string(60'000, '['));
  const auto bad = run_plcctl(domain_.number(), look);
  EXPECT_NE(bad.code, 0) << bad.output;
  EXPECT_THAT(bad.errors, HasSubstr("the host's answer is not understood"));
}

TEST_F(StateOfADebugger, IsNoneWithoutADebugBuild) {
  const auto part = read("line2", {});
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().code, ErrorCode::not_found);
  EXPECT_THAT(part.error().message, HasSubstr("--debug"));
}

}  // namespace
}  // namespace plchost
