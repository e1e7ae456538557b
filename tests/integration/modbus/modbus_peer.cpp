#include "tests/integration/modbus/modbus_peer.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

namespace plchost::testing {

namespace {

constexpr int kLookMs = 10;  // how soon the thread sees that it is to end

void check(bool good, const char* step) {
  if (!good) throw std::runtime_error(step);
}

UniqueFd bound_socket(std::uint16_t& port) {
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int one = 1;
  check(::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) == 0, "SO_REUSEADDR");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  check(::bind(fd.get(), reinterpret_cast<sockaddr*>(&address), size) == 0, "bind");
  check(::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size) == 0, "getsockname");
  port = ntohs(address.sin_port);
  return fd;
}

}  // namespace

HeldPort::HeldPort() : fd_(bound_socket(number_)) {}

std::string HeldPort::address() const {
  return fmt::format("127.0.0.1:{}", number_);
}

SerialLine::SerialLine() : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
  check(master_ && ::grantpt(master_.get()) == 0 && ::unlockpt(master_.get()) == 0, "posix_openpt");
  std::array<char, 64> name{};
  check(::ptsname_r(master_.get(), name.data(), name.size()) == 0, "ptsname_r");
  path_ = name.data();
  held_ = UniqueFd(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  termios raw{};
  check(::tcgetattr(held_.get(), &raw) == 0, "tcgetattr");
  ::cfmakeraw(&raw);
  check(::tcsetattr(held_.get(), TCSANOW, &raw) == 0, "tcsetattr");
}

void ModbusPeer::make_mapping() {
  mapping_ = modbus_mapping_new(kRegisters, kRegisters, kRegisters, kRegisters);
  check(context_ != nullptr && mapping_ != nullptr, "libmodbus");
}

ModbusPeer::ModbusPeer(const HeldPort& port, Mode mode)
    : context_(modbus_new_tcp("127.0.0.1", port.number())), mode_(mode) {
  make_mapping();
  std::uint16_t number = port.number();
  listener_ = bound_socket(number);
  check(::listen(listener_.get(), 8) == 0, "listen");
  thread_ = std::thread([this] { run(); });
}

ModbusPeer::ModbusPeer(const SerialLine& line, int unit)
    : context_(modbus_new_rtu(line.path().c_str(), 19'200, 'N', 8, 1)),
      mode_(Mode::normal),
      line_(line.other_end()),
      unit_(unit) {
  make_mapping();
  check(modbus_set_slave(context_, unit) == 0, "unit");
  modbus_set_socket(context_, line_);
  thread_ = std::thread([this] { run_line(); });
}

ModbusPeer::~ModbusPeer() {
  ends_ = true;
  thread_.join();
  modbus_mapping_free(mapping_);
  modbus_free(context_);
}

void ModbusPeer::with(const std::function<void(modbus_mapping_t&)>& use) {
  const std::lock_guard lock(mutex_);
  use(*mapping_);
}

int ModbusPeer::holding(int address) {
  const std::lock_guard lock(mutex_);
  return mapping_->tab_registers[address];
}

int ModbusPeer::coil(int address) {
  const std::lock_guard lock(mutex_);
  return mapping_->tab_bits[address];
}

void ModbusPeer::run() {
  std::vector<UniqueFd> clients;
  while (!ends_) {
    std::vector<pollfd> fds{{.fd = listener_.get(), .events = POLLIN, .revents = 0}};
    for (const UniqueFd& client : clients)
      fds.push_back({.fd = client.get(), .events = POLLIN, .revents = 0});
    if (::poll(fds.data(), fds.size(), kLookMs) <= 0) continue;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (fds[i + 1].revents != 0 && !serve(clients[i].get())) clients[i].reset();
    }
    std::erase_if(clients, [](const UniqueFd& client) { return !client; });
    if (fds[0].revents != 0) clients.emplace_back(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  }
}

// A request ends where the line is quiet. modbus_receive would take the one behind that of another unit for
// its response, and lose its place.
void ModbusPeer::run_line() {
  Request request{};
  std::size_t size = 0;
  while (!ends_) {
    pollfd look{.fd = line_, .events = POLLIN, .revents = 0};
    if (::poll(&look, 1, kLookMs) > 0 && size < request.size()) {
      size += static_cast<std::size_t>(
          std::max<ssize_t>(::read(line_, &request.at(size), request.size() - size), 0));
    } else if (size != 0) {
      if (request[0] == unit_) (void)answer(line_, request, static_cast<int>(size));
      size = 0;
    }
  }
}

bool ModbusPeer::serve(int fd) {
  modbus_set_socket(context_, fd);
  Request request{};
  const int size = modbus_receive(context_, request.data());
  return size >= 0 && answer(fd, request, size);
}

// Of a write as it is confirmed, or of a read of one register; with another byte at that place.
bool ModbusPeer::answer_altered(int fd, Request& request, std::size_t at, std::uint8_t byte) {
  std::size_t size = 12;
  request[5] = 6;
  if (request[7] == MODBUS_FC_READ_INPUT_REGISTERS) {
    size = 11;
    request[5] = 5;
    request[8] = 2;
  }
  request[at] = byte;
  return ::send(fd, request.data(), size, MSG_NOSIGNAL) > 0;
}

bool ModbusPeer::refuses(const Request& request) const {
  const int function = request[7];
  const bool is_single =
      function == MODBUS_FC_WRITE_SINGLE_COIL || function == MODBUS_FC_WRITE_SINGLE_REGISTER;
  const bool is_several =
      function == MODBUS_FC_WRITE_MULTIPLE_COILS || function == MODBUS_FC_WRITE_MULTIPLE_REGISTERS;
  if (mode_ == Mode::no_single) return is_single;
  return mode_ == Mode::no_several ? is_several : (request[8] << 8U | request[9]) >= kHalf;
}

bool ModbusPeer::answer(int fd, Request& request, int size) {
  ++requests_;
  static constexpr std::array<char, 300> kGarbage{'g', 'a', 'r'};
  const std::lock_guard lock(mutex_);
  switch (mode_.load()) {
    case Mode::stalls:
      return true;
    case Mode::garbage:
      return ::send(fd, kGarbage.data(), kGarbage.size(), MSG_NOSIGNAL) > 0;
    case Mode::dribbles:
      request[4] = 0;
      request[5] = 253;  // so many bytes would follow
      request[7] = MODBUS_FC_READ_HOLDING_REGISTERS;
      request[8] = 250;
      for (int i = 0; i < 40 && !ends_ && mode_ == Mode::dribbles; ++i) {
        if (::send(fd, &request[static_cast<std::size_t>(std::min(i, 9))], 1, MSG_NOSIGNAL) <= 0)
          return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
      return true;
    case Mode::refuses:
      return modbus_reply_exception(context_, request.data(), MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS) > 0;
    case Mode::unreachable:
      return modbus_reply_exception(context_, request.data(), MODBUS_EXCEPTION_GATEWAY_TARGET) > 0;
    case Mode::no_single:
    case Mode::no_several:
    case Mode::half:
      if (refuses(request)) {
        return modbus_reply_exception(context_, request.data(), MODBUS_EXCEPTION_ILLEGAL_FUNCTION) > 0;
      }
      break;
    case Mode::answers_another:
      --request[1];
      if (modbus_reply(context_, request.data(), size, mapping_) < 0) return false;
      ++request[1];
      break;
    case Mode::other_unit:
      ++request[6];
      break;
    case Mode::other_length:
      return answer_altered(fd, request, 5, 60);
    case Mode::other_protocol:
      return answer_altered(fd, request, 3, 1);
    case Mode::other_write:
      if (request[7] == MODBUS_FC_WRITE_MULTIPLE_REGISTERS) return answer_altered(fd, request, 9, 99);
      break;
    case Mode::own_exception:
      request[5] = 3;
      request[7] |= 0x80U;
      request[8] = kOwnException;
      return ::send(fd, request.data(), 9, MSG_NOSIGNAL) > 0;
    case Mode::slow:
      std::this_thread::sleep_for(kSlow);
      break;
    case Mode::late:
      held_.push_back({.request = request, .size = size});
      if (held_.size() <= static_cast<std::size_t>(late_by_)) return true;
      request = held_.front().request;
      size = held_.front().size;
      held_.pop_front();
      break;
    case Mode::ends:
      return modbus_reply(context_, request.data(), size, mapping_) < 0;
    case Mode::echoes:
    case Mode::normal:
      break;
  }
  if (mode_ != Mode::late) held_.clear();
  const bool replied = modbus_reply(context_, request.data(), size, mapping_) >= 0;
  if (mode_ == Mode::echoes) {
    std::copy_n(mapping_->tab_registers, kRegisters, mapping_->tab_input_registers);
  }
  return replied;
}

}  // namespace plchost::testing
