// Tests wait for lines of other programs with it.

#include "tests/support/whole_lines.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>

#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(WholeLines, LeaveOutTheOneThatIsBeingWritten) {
  const std::string path = ::testing::TempDir() + own_name("lines");
  EXPECT_THAT(whole_lines(path), IsEmpty());
  std::ofstream file(path);
  file << "17 --host cell\n18 --host" << std::flush;
  EXPECT_THAT(whole_lines(path), ElementsAre("17 --host cell"));
  file << " cell\n\n" << std::flush;
  EXPECT_THAT(whole_lines(path), ElementsAre("17 --host cell", "18 --host cell", ""));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace plchost
