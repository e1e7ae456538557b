#include "shm/sockets/packet_socket.hpp"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/support/in_a_child.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost {
namespace {

class PacketSocketTest : public testing::Test {
 protected:
  PacketSocketTest() {
    directory_ = own_path("socket");
    std::filesystem::create_directory(directory_);
    path_ = directory_ / "s";
  }
  ~PacketSocketTest() override { std::filesystem::remove_all(directory_); }

  void connect() {
    auto listener = PacketListener::listen(path_);
    ASSERT_TRUE(listener) << listener.error().describe();
    listener_.emplace(std::move(*listener));
    auto client = PacketSocket::connect(path_);
    ASSERT_TRUE(client) << client.error().describe();
    client_ = std::move(*client);
    auto server = listener_->accept();
    ASSERT_TRUE(server && *server);
    server_ = std::move(**server);
  }

  static TimePoint soon() { return MonotonicClock::now() + std::chrono::seconds(10); }

  std::filesystem::path directory_;
  std::string path_;
  std::optional<PacketListener> listener_;
  PacketSocket client_;
  PacketSocket server_;
};

TEST_F(PacketSocketTest, KeepsPacketsWholeAndInOrder) {
  connect();
  ASSERT_TRUE(client_.send("one"));
  ASSERT_TRUE(client_.send("two"));
  EXPECT_EQ(receive_until(server_, soon()), "one");
  EXPECT_EQ(receive_until(server_, soon()), "two");
  EXPECT_EQ(server_.receive().value(), std::nullopt);
}

TEST_F(PacketSocketTest, CarriesTheLargestPacketAndRefusesLarger) {
  connect();
  const std::string largest(kMaxPacket, 'x');
  ASSERT_TRUE(client_.send(largest));
  EXPECT_EQ(receive_until(server_, soon()), largest);
  EXPECT_EQ(client_.send(largest + "x").error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(client_.send("").error().code, ErrorCode::invalid_argument);
}

TEST_F(PacketSocketTest, ALargerPacketOfAStrangerIsCorrupt) {
  connect();
  const std::string larger(kMaxPacket + 100, 'x');
  ASSERT_EQ(::send(client_.fd(), larger.data(), larger.size(), 0), static_cast<ssize_t>(larger.size()));
  EXPECT_EQ(server_.receive().error().code, ErrorCode::corrupt);
}

TEST_F(PacketSocketTest, SeesTheEndOfThePeer) {
  connect();
  client_.close();
  EXPECT_EQ(server_.receive().error().code, ErrorCode::unavailable);
  EXPECT_EQ(server_.send("x").error().code, ErrorCode::unavailable);
}

TEST_F(PacketSocketTest, IsBusyWhenThePeerDoesNotRead) {
  connect();
  const std::string packet(kMaxPacket, 'x');
  Result<void> sent;
  for (int i = 0; i < 10'000 && sent; ++i) sent = client_.send(packet);
  ASSERT_FALSE(sent);
  EXPECT_EQ(sent.error().code, ErrorCode::busy);
}

TEST_F(PacketSocketTest, TimesOutWithoutAPacket) {
  connect();
  const TimePoint deadline = MonotonicClock::now() + std::chrono::milliseconds(5);
  EXPECT_EQ(receive_until(server_, deadline).error().code, ErrorCode::timed_out);
  EXPECT_GE(MonotonicClock::now(), deadline);
}

TEST_F(PacketSocketTest, KnowsThePeer) {
  connect();
  EXPECT_EQ(server_.peer_pid(), ::getpid());
}

TEST_F(PacketSocketTest, IsCutWhenThePeerHasClosedItsEnd) {
  connect();
  ASSERT_TRUE(server_.send("a packet that nobody takes"));
  EXPECT_FALSE(client_.is_cut());
  server_.close();
  EXPECT_TRUE(client_.is_cut());
}

TEST_F(PacketSocketTest, IsCutWhenTheListenerHasGoneBeforeItTookTheConnection) {
  connect();
  const auto waiting = PacketSocket::connect(path_);
  ASSERT_TRUE(waiting);
  EXPECT_FALSE(waiting->is_cut());
  listener_.reset();
  EXPECT_TRUE(waiting->is_cut());
}

TEST_F(PacketSocketTest, AcceptGivesNothingIfNobodyWaits) {
  connect();
  const auto accepted = listener_->accept();
  ASSERT_TRUE(accepted);
  EXPECT_FALSE(*accepted);
}

TEST_F(PacketSocketTest, ConnectFailsWhereNobodyListens) {
  EXPECT_EQ(PacketSocket::connect(path_).error().code, ErrorCode::unavailable);
}

TEST_F(PacketSocketTest, ConnectNamesTheFolderThatKeepsAUserOut) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  const auto inner = directory_ / "inner";
  std::filesystem::create_directory(inner);
  const auto listener = PacketListener::listen(inner / "s");
  ASSERT_TRUE(listener) << listener.error().describe();
  const auto refused = [&](std::filesystem::perms closed, std::filesystem::perms open) {
    std::filesystem::permissions(directory_, closed);
    std::filesystem::permissions(inner, open);
    return in_a_child([&] {
      // By the calls themselves: the library's would also ask threads that a sanitizer's child does not have.
      const bool nobody = ::syscall(SYS_setgroups, 0, nullptr) == 0 &&
                          ::syscall(SYS_setresgid, -1, 65534, -1) == 0 &&
                          ::syscall(SYS_setresuid, -1, 65534, -1) == 0;
      if (!nobody) return std::string("cannot become another user");
      return PacketSocket::connect(inner / "s").error().describe();
    });
  };
  using std::filesystem::perms;
  EXPECT_THAT(refused(perms::owner_all, perms::all),
              testing::HasSubstr("user 65534 may not enter " + directory_.string() + ": Permission denied"));
  EXPECT_THAT(refused(perms::all, perms::owner_all),
              testing::HasSubstr("user 65534 may not enter " + inner.string() + ":"));
  EXPECT_THAT(refused(perms::all, perms::all), testing::HasSubstr("user 65534 may not write to it:"));
}

TEST_F(PacketSocketTest, ConnectIsBusyWhenTooManyWait) {
  connect();
  std::vector<PacketSocket> waiting;
  Result<PacketSocket> last = PacketSocket::connect(path_);
  for (int i = 0; i < 100 && last; ++i) {
    waiting.push_back(std::move(*last));
    last = PacketSocket::connect(path_);
  }
  ASSERT_FALSE(last);
  EXPECT_EQ(last.error().code, ErrorCode::busy);
}

TEST_F(PacketSocketTest, RefusesAPathThatIsTooLong) {
  const std::string path(108, 'x');
  EXPECT_EQ(PacketListener::listen(path).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(PacketSocket::connect(path).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(PacketSocket::connect("").error().code, ErrorCode::invalid_argument);
}

TEST_F(PacketSocketTest, ListenerTakesThePlaceOfAnOldOneWhichLeavesItsFile) {
  auto old = PacketListener::listen(path_);
  ASSERT_TRUE(old);
  {
    auto sut = PacketListener::listen(path_);
    ASSERT_TRUE(sut);
    {
      const PacketListener ended = std::move(*old);
    }
    EXPECT_TRUE(PacketSocket::connect(path_));
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(PacketSocketTest, ListenerRemovesItsFileWhenAssignedAnother) {
  auto sut = PacketListener::listen(path_);
  auto other = PacketListener::listen(path_ + "2");
  ASSERT_TRUE(sut && other);
  *sut = std::move(*other);
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_TRUE(PacketSocket::connect(path_ + "2"));
}

TEST_F(PacketSocketTest, FileIsForOwnerAndGroup) {
  connect();
  struct stat status{};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

}  // namespace
}  // namespace plchost
