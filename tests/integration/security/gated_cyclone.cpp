// gated_cyclone DOMAIN FD PARENT: Cyclone behind the gate of an unsecured host, as plchost-dds has it, for
// tests that ask whether it survives what the gate passes. FD: a GateBoard. With FD -1 it is a client that
// says all that clients say, for the seeds.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <netinet/in.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "api/dds/domain.hpp"
#include "api/dds/gate/packet_gate.hpp"
#include "api/dds/topics.hpp"
#include "shm/process/end_with_parent.hpp"
#include "tests/integration/security/gate_board.hpp"

extern char** environ;

namespace {

using plchost::GateBoard;
namespace dds = plchost::dds;

GateBoard* board = nullptr;

std::uint16_t port_of(const msghdr& message) {
  if (message.msg_name == nullptr || message.msg_namelen < sizeof(sockaddr_in)) return 0;
  return ntohs(static_cast<const sockaddr_in*>(message.msg_name)->sin_port);
}

void keep_seed(std::span<const std::byte> datagram) {
  const std::uint32_t index = board->seed_count;
  if (index >= GateBoard::kSeeds || datagram.size() > sizeof board->seeds[0].bytes) return;
  std::memcpy(board->seeds[index].bytes.data(), datagram.data(), datagram.size());
  board->seeds[index].size = static_cast<std::uint32_t>(datagram.size());
  board->seed_count = index + 1;
}

/// The entities of one side. All are in one partition; the client writes the topics that the host reads.
class Side {
 public:
  Side(dds::Role role, std::uint32_t domain) : is_host_(role == dds::Role::server) {
    dds::DomainOptions options;
    options.domain = domain;
    domain_ = dds::open_domain(role, options).value();
    participant_ = dds::Entity(dds_create_participant(domain, nullptr, nullptr));
    publisher_ = dds::make_publisher(participant_.get(), "h.cell").value();
    subscriber_ = dds::make_subscriber(participant_.get(), "h.cell").value();
    add(dds::kOperatorRequest, dds::qos_of(dds::kOperatorRequest), is_host_);
    add(dds::kEventPost, dds::qos_of(dds::kEventPost), is_host_);
    add(dds::kDownloadChunk, dds::qos_of(dds::kDownloadChunk), is_host_);
    add(dds::kNameClaim, dds::qos_of(dds::kNameClaim), is_host_);
    add(dds::kReply, dds::qos_of(dds::kReply), !is_host_);
    add(dds::kEventAck, dds::qos_of(dds::kEventAck), !is_host_);
    add(dds::kPresence, dds::qos_of(dds::kPresence), !is_host_);
  }

  void take_all() {
    for (const dds::Entity& reader : readers_) {
      std::array<void*, 64> samples{};
      std::array<dds_sample_info_t, 64> infos{};
      const auto count = dds_take(reader.get(), samples.data(), infos.data(), samples.size(), samples.size());
      if (count > 0) (void)dds_return_loan(reader.get(), samples.data(), count);
    }
  }
  /// The samples of a client.
  void write_requests(int number) {
    plc_Request request{};
    request.header.request_identity.sequence_number = number;
    std::strcpy(request.instance, "line1");
    (void)dds_write(writers_.at(0).get(), &request);
    plc_EventPost post{};
    post.sequence_number = static_cast<std::uint64_t>(number);
    (void)dds_write(writers_.at(1).get(), &post);
    if (number % 16 == 0) {
      std::vector<std::uint8_t> bytes(30'000);
      plc_DownloadChunk chunk{};
      chunk.contents = {30'000, 30'000, bytes.data(), false};
      (void)dds_write(writers_.at(2).get(), &chunk);
      plc_NameClaim claim{};
      (void)dds_write(writers_.at(3).get(), &claim);
      (void)dds_dispose(writers_.at(3).get(), &claim);
    }
  }
  /// The samples of a host.
  void write_replies() {
    const plc_Reply reply{};
    (void)dds_write(writers_.at(0).get(), &reply);
    const plc_Presence presence{};
    (void)dds_write(writers_.at(2).get(), &presence);
  }

 private:
  void add(const dds::TopicInfo& info, const dds::Qos& qos, bool reads) {
    topics_.push_back(dds::make_topic(participant_.get(), info).value());
    const dds_entity_t topic = topics_.back().get();
    if (reads) {
      readers_.push_back(dds::make_reader(subscriber_.get(), topic, qos).value());
    } else {
      writers_.push_back(dds::make_writer(publisher_.get(), topic, qos).value());
    }
  }

  bool is_host_;
  std::shared_ptr<dds::Entity> domain_;
  dds::Entity participant_;
  dds::Entity publisher_;
  dds::Entity subscriber_;
  std::vector<dds::Entity> topics_;
  std::vector<dds::Entity> readers_;
  std::vector<dds::Entity> writers_;
};

void be_client(std::uint32_t domain) {
  Side side(dds::Role::client, domain);
  for (int i = 1; i <= 100; ++i) {
    side.write_requests(i);
    side.take_all();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

[[noreturn]] void be_host(char** argv, std::uint32_t domain) {
  Side side(dds::Role::server, domain);
  std::string program = "/proc/self/exe";
  std::string no_board = "-1";
  std::string parent = std::to_string(pid_t{::getpid()});
  std::array<char*, 5> arguments{argv[0], argv[1], no_board.data(), parent.data(), nullptr};
  pid_t client = 0;
  if (::posix_spawn(&client, program.c_str(), nullptr, nullptr, arguments.data(), environ) != 0) {
    std::_Exit(1);
  }
  while (::waitpid(client, nullptr, WNOHANG) == 0) {
    side.write_replies();
    side.take_all();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  board->ready = true;
  for (int i = 0;; ++i) {
    side.take_all();
    if (i % 8 == 0) side.write_replies();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace

// As in api/server/access/receive_gate.cpp, without the table of the senders' ports: they are all one.
extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int socket, msghdr* message, int flags) {
  static thread_local bool is_of_feeder = false;
  if (is_of_feeder) ++board->done;
  is_of_feeder = false;
  const ssize_t got = ::syscall(SYS_recvmsg, socket, message, flags);
  if (board == nullptr || got <= 0 || message->msg_iovlen != 1) return got;
  const std::span datagram(static_cast<std::byte*>(message->msg_iov->iov_base),
                           static_cast<std::size_t>(got));
  is_of_feeder = board->ready && port_of(*message) == board->feeder_port;
  if (!board->ready) keep_seed(datagram);
  if (dds::admit(datagram, false) == dds::Admission::refused) return 1;
  if (is_of_feeder) ++board->passed;
  return got;
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  if (!plchost::end_with_parent(std::atoi(argv[3]), SIGKILL)) return 1;
  const auto domain = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
  const int fd = std::atoi(argv[2]);
  dds_set_log_mask(0);
  if (fd < 0) {
    be_client(domain);
    return 0;
  }
  void* const memory = ::mmap(nullptr, sizeof(GateBoard), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (memory == MAP_FAILED) return 2;
  board = static_cast<GateBoard*>(memory);
  be_host(argv, domain);
}
