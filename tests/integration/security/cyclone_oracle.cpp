#include "tests/integration/security/cyclone_oracle.hpp"

#include <array>
#include <chrono>
#include <fstream>
#include <new>
#include <thread>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace plchost {

namespace {

constexpr std::chrono::seconds kPatienceWithCyclone{10};

sockaddr_in on_loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

}  // namespace

std::optional<CycloneOracle> CycloneOracle::start(const std::string& program, std::uint32_t domain) {
  const UniqueFd memory(::memfd_create("gate-board", 0));
  if (!memory || ::ftruncate(memory.get(), sizeof(GateBoard)) != 0) return std::nullopt;
  void* const mapped =
      ::mmap(nullptr, sizeof(GateBoard), PROT_READ | PROT_WRITE, MAP_SHARED, memory.get(), 0);
  if (mapped == MAP_FAILED) return std::nullopt;
  auto* const board = new (mapped) GateBoard;
  UniqueFd socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in own = on_loopback(0);
  socklen_t size = sizeof own;
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0 ||
      ::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&own), &size) != 0) {
    return std::nullopt;
  }
  board->feeder_port = ntohs(own.sin_port);
  std::array<std::string, 4> texts{program, std::to_string(domain), std::to_string(memory.get()),
                                   std::to_string(pid_t{::getpid()})};
  std::array<char*, 5> arguments{texts[0].data(), texts[1].data(), texts[2].data(), texts[3].data(), nullptr};
  pid_t pid = 0;
  if (::posix_spawn(&pid, program.c_str(), nullptr, nullptr, arguments.data(), environ) != 0) {
    return std::nullopt;
  }
  // As in DDS: of the first participant.
  CycloneOracle made(pid, board, std::move(socket), static_cast<std::uint16_t>(7400 + 250 * domain + 10));
  const auto end = std::chrono::steady_clock::now() + 3 * kPatienceWithCyclone;
  while (!board->ready) {
    if (::waitpid(pid, nullptr, WNOHANG) != 0 || std::chrono::steady_clock::now() > end) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return made;
}

CycloneOracle::CycloneOracle(CycloneOracle&& other) noexcept
    : pid_(std::exchange(other.pid_, 0)),
      board_(std::exchange(other.board_, nullptr)),
      socket_(std::move(other.socket_)),
      port_(other.port_),
      sent_(other.sent_),
      last_(std::move(other.last_)) {}

CycloneOracle::~CycloneOracle() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  if (board_ != nullptr) ::munmap(board_, sizeof(GateBoard));
}

std::vector<Packet> CycloneOracle::seeds() const {
  std::vector<Packet> packets;
  for (std::uint32_t i = 0; i < board_->seed_count; ++i) {
    const GateBoard::Seed& seed = board_->seeds[i];
    packets.emplace_back(seed.bytes.begin(), seed.bytes.begin() + seed.size);
  }
  return packets;
}

bool CycloneOracle::feed(const Packet& packet) {
  const sockaddr_in to = on_loopback(port_);
  // Discovery and data come to two ports, which one thread serves.
  sockaddr_in other = on_loopback(static_cast<std::uint16_t>(port_ + 1));
  const auto& address = sent_ % 2 == 0 ? to : other;
  if (::sendto(socket_.get(), packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address),
               sizeof address) < 0) {
    return true;
  }
  ++sent_;
  last_.push_back(packet);
  if (last_.size() > kLast) last_.pop_front();
  return sent_ <= kUnderWay || wait_until_done(sent_ - kUnderWay);
}

bool CycloneOracle::flush() {
  // The last one counts when the next one is asked for.
  const std::uint64_t count = sent_;
  const Packet nothing(8);
  for (int i = 0; i < 2; ++i) {
    if (!feed(nothing)) return false;
  }
  return wait_until_done(count);
}

bool CycloneOracle::wait_until_done(std::uint64_t count) {
  const auto end = std::chrono::steady_clock::now() + kPatienceWithCyclone;
  while (board_->done < count) {
    if (::waitpid(pid_, nullptr, WNOHANG) != 0) {
      pid_ = 0;
      return false;
    }
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  }
  return true;
}

void CycloneOracle::save_last(const std::string& path) const {
  std::ofstream file(path, std::ios::binary);
  for (const Packet& packet : last_) {
    const auto size = static_cast<std::uint32_t>(packet.size());
    file.write(reinterpret_cast<const char*>(&size), sizeof size);
    file.write(reinterpret_cast<const char*>(packet.data()), size);
  }
}

}  // namespace plchost
