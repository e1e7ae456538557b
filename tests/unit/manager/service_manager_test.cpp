// systemd that does not read, and a D-Bus that does not answer.

#include "manager/system/service_manager.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "shm/base/unique_fd.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

class ServiceManager : public testing::Test {
 protected:
  ~ServiceManager() override {
    for (const char* const name : {"NOTIFY_SOCKET", "INVOCATION_ID", "DBUS_SYSTEM_BUS_ADDRESS"})
      ::unsetenv(name);  // NOLINT(concurrency-mt-unsafe)
    std::filesystem::remove(path_);
  }
  /// A socket that is bound to path_.
  [[nodiscard]] UniqueFd bound(int type) const {
    UniqueFd socket(::socket(AF_UNIX, type | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(std::begin(address.sun_path), path_.size());
    EXPECT_EQ(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return socket;
  }
  static std::string next(const UniqueFd& socket) {
    std::array<char, 200> text{};
    const ssize_t size = ::recv(socket.get(), text.data(), text.size(), MSG_DONTWAIT);
    return size < 0 ? "" : std::string(text.data(), static_cast<std::size_t>(size));
  }

  std::string path_ = (std::filesystem::temp_directory_path() / own_name("service")).string();
};

TEST_F(ServiceManager, ThatDoesNotReadIsNotWaitedForAndToldLater) {
  const UniqueFd socket = bound(SOCK_DGRAM);
  ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  std::size_t filled = 0;
  const auto fill = [&] {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(std::begin(address.sun_path), path_.size());
    const UniqueFd other(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    while (::sendto(other.get(), "x", 1, MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&address),
                    sizeof address) == 1)
      ++filled;
  };
  fill();
  ASSERT_GT(filled, 0U);
  notify_service_manager("READY=1");
  notify_service_manager("STOPPING=1");
  for (std::size_t i = 0; i < filled; ++i) EXPECT_EQ(next(socket), "x");
  EXPECT_EQ(next(socket), "");
  notify_of_the_rest();
  EXPECT_EQ(next(socket), "READY=1");
  EXPECT_EQ(next(socket), "STOPPING=1");
  notify_of_the_rest();
  EXPECT_EQ(next(socket), "") << "each is told once";
}

TEST_F(ServiceManager, ThatSaysNothingOverDBusIsNotWaitedForLong) {
  const UniqueFd socket = bound(SOCK_STREAM);
  ASSERT_EQ(::listen(socket.get(), 4), 0);
  ::setenv("INVOCATION_ID", "0123456789abcdef0123456789abcdef", 1);        // NOLINT(concurrency-mt-unsafe)
  ::setenv("DBUS_SYSTEM_BUS_ADDRESS", ("unix:path=" + path_).c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  const auto restarted = is_being_restarted();
  ASSERT_FALSE(restarted);
  EXPECT_EQ(restarted.error().code, ErrorCode::timed_out);
  EXPECT_THAT(restarted.error().message, testing::HasSubstr("within 2 s"));
}

TEST_F(ServiceManager, ThatIsNoneIsToldNothing) {
  notify_service_manager("READY=1");
  const auto restarted = is_being_restarted();
  ASSERT_TRUE(restarted);
  EXPECT_FALSE(*restarted);
}

}  // namespace
}  // namespace plchost
