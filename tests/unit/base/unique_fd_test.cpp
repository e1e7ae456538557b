#include "shm/base/unique_fd.hpp"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace plchost {
namespace {

bool is_open(int fd) {
  return ::fcntl(fd, F_GETFD) != -1;
}

TEST(UniqueFd, ClosesWhatItOwns) {
  int fd = -1;
  {
    const UniqueFd sut(::dup(STDERR_FILENO));
    fd = sut.get();
    ASSERT_TRUE(is_open(fd));
  }
  EXPECT_FALSE(is_open(fd));
}

TEST(UniqueFd, MovesOwnership) {
  UniqueFd from(::dup(STDERR_FILENO));
  const int fd = from.get();
  UniqueFd sut;
  sut = std::move(from);
  EXPECT_EQ(sut.get(), fd);
  EXPECT_TRUE(is_open(fd));
  EXPECT_EQ(sut.release(), fd);
  EXPECT_FALSE(sut);
  EXPECT_EQ(::close(fd), 0);
}

}  // namespace
}  // namespace plchost
