#include <filesystem>

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "instances/runtime/tasks/registered_events.hpp"
#include "shm/base/transient.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class OperatorEvents : public ::testing::Test {
 protected:
  ~OperatorEvents() override { std::filesystem::remove(path_); }
  std::string path_ = std::filesystem::temp_directory_path() / own_name("operator_events");
};

TEST_F(OperatorEvents, AreReadAsTheyWereWritten) {
  EXPECT_THAT(read_operator_events(path_).value(), IsEmpty());
  ASSERT_TRUE(write_operator_events(path_, {"ready", "full"}));
  EXPECT_THAT(read_operator_events(path_).value(), ElementsAre("ready", "full"));
  ASSERT_TRUE(write_operator_events(path_, {}));
  EXPECT_THAT(read_operator_events(path_).value(), IsEmpty());
}

// Otherwise the next registration would write the file without them.
TEST_F(OperatorEvents, ThatCannotBeReadForAMomentAreNotTakenForNone) {
  ASSERT_TRUE(write_operator_events(path_, {"ready"}));
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{.rlim_cur = 3, .rlim_max = before.rlim_max};
  ::setrlimit(RLIMIT_NOFILE, &none);
  const auto events = read_operator_events(path_);
  ::setrlimit(RLIMIT_NOFILE, &before);
  ASSERT_FALSE(events);
  EXPECT_TRUE(is_transient(events.error())) << events.error().describe();
}

}  // namespace
}  // namespace plchost
