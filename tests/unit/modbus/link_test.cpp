#include "instances/io/modbus/client/link.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace plchost::modbus {
namespace {

using namespace std::chrono_literals;

/// A device that confirms one write of a coil, some time behind it.
class SlowDevice {
 public:
  SlowDevice() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(::bind(listener_.get(), any, size), 0);
    EXPECT_EQ(::listen(listener_.get(), 1), 0);
    EXPECT_EQ(::getsockname(listener_.get(), any, &size), 0);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~SlowDevice() {
    ::shutdown(listener_.get(), SHUT_RDWR);
    thread_.join();
  }
  SlowDevice(const SlowDevice&) = delete;
  SlowDevice& operator=(const SlowDevice&) = delete;
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] bool was_asked() const { return was_asked_; }

 private:
  void run() {
    const UniqueFd client(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    std::array<std::uint8_t, 12> request{};
    if (!client || ::recv(client.get(), request.data(), request.size(), MSG_WAITALL) <= 0) return;
    was_asked_ = true;
    std::this_thread::sleep_for(100ms);
    (void)::send(client.get(), request.data(), request.size(), MSG_NOSIGNAL);
  }

  UniqueFd listener_;
  std::uint16_t port_ = 0;
  std::atomic<bool> was_asked_{false};
  std::thread thread_;
};

TEST(Link, AnInterruptSparesTheRequestsOfTheEnd) {
  const SlowDevice peer;
  DeviceConfig device;
  device.tcp = fmt::format("127.0.0.1:{}", peer.port());
  const auto stop = StopEvent::make();
  ASSERT_TRUE(stop);
  const auto link = Link::make(device, *stop);
  ASSERT_TRUE(link);
  EXPECT_EQ((*link)->answered_at_end(), TimePoint());
  stop->set();
  std::atomic<bool> has_ended{false};
  std::thread end([&] {
    RegisterMap map;
    map.kind = RegisterKind::coil;
    MapValues zeros;
    const auto written = (*link)->write_at_end(device, map, zeros, 10s);
    EXPECT_TRUE(written) << written.error().text;
    has_ended = true;
  });
  while (!has_ended) {
    if (peer.was_asked()) (*link)->interrupt();
    std::this_thread::sleep_for(1ms);
  }
  end.join();
  EXPECT_NE((*link)->answered_at_end(), TimePoint());
}

}  // namespace
}  // namespace plchost::modbus
