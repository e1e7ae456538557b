#include "tests/integration/api/test_host.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <utility>

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "api/control/control_handler.hpp"
#include "instances/launch/launch_contract.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/pages/transition_ring.hpp"
#include "tests/support/interrupted_write.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost {

OwnDomain::OwnDomain() {
  // All ports of these domains are below the range that clients get theirs from. The last port of a domain is
  // used by no participant: the process that has it has the domain.
  constexpr std::uint32_t kDomains = 100;
  const auto first = static_cast<std::uint32_t>(::getpid());
  for (std::uint32_t i = 0; i < kDomains && number_ == 0; ++i) {
    const std::uint32_t domain = 1 + (first + i) % kDomains;
    UniqueFd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain + 249));
    if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) continue;
    claim_ = std::move(fd);
    number_ = domain;
  }
}

TestHost::TestHost(const OwnDomain& domain, std::string name, std::uint32_t max_objects)
    : domain_(domain.number()),
      name_(std::move(name)),
      pool_name_(own_name("api")),
      run_directory_(std::filesystem::temp_directory_path() / pool_name_),
      pool_(ObjectPool::create(pool_name_, {.max_objects = max_objects}).value()),
      page_(HostPageWriter::create(pool_name_).value()) {
  std::filesystem::create_directory(run_directory_);
  write_count(0);
  // Before there is a server, which ends if nobody listens.
  manager_ =
      std::jthread([this, listener = PacketListener::listen(manager_socket_path(run_directory_)).value()](
                       const std::stop_token& stop) mutable { serve(listener, stop); });
}

TestHost::~TestHost() {
  server_.reset();
  manager_ = {};
  for (const std::string& instance : instances_) {
    InstancePage::remove(pool_name_, instance);
    FlightPage::remove(pool_name_, instance);
    TransitionRing::remove(pool_name_, instance);
    LogRing::remove(pool_name_, instance);
  }
  MemoryFile::remove(host_page_name(pool_name_));
  MemoryFile::remove(pool_name_ + ".posts");
  ObjectPool::remove(pool_name_);
  std::filesystem::remove_all(run_directory_);
}

PoolEvent TestHost::add_event(const std::string& instance, const std::string& event) {
  const PoolEvent made = pool_.create_event(event_object_name(instance, event)).value();
  made.set_registered(true);
  return made;
}

void TestHost::write_count(std::uint32_t count) {
  HostStatus status;
  status.name.assign(name_);
  status.version.assign("0.1.0");
  status.manager_pid = ::getpid();
  status.instance_count = count;
  const std::lock_guard lock(page_mutex_);
  page_.write_host(status);
}

void TestHost::write_instance(std::uint32_t index, const std::string& name, InstanceState state,
                              std::int32_t pid) {
  InstanceStatus status;
  status.name.assign(name);
  status.scheduler.assign("CmpSchedule");
  status.state = state;
  status.pid = pid;
  status.core = 1;
  status.plan = {.restart = RestartPolicy::on_failure,
                 .crash_limit = 5,
                 .crash_window_ns = 60'000'000'000,
                 .restart_delay_ns = 100'000'000,
                 .restart_delay_max_ns = 5'000'000'000,
                 .autostart = 1,
                 .share_core = 0,
                 .priority_band = FixedText<15>("normal"),
                 .settings = FixedText<kMaxPath>("/etc/line1.cfg"),
                 .application = FixedText<kMaxPath>("/opt/line1.so"),
                 .after = FixedText<kMaxAfter>("io,axis")};
  const std::lock_guard lock(page_mutex_);
  page_.write_instance(index, status);
}

void TestHost::interrupt_instance(std::uint32_t index) {
  const auto memory =
      MemoryFile::open(host_page_name(pool_name_), sizeof(HostPageLayout), MemoryFile::Access::read_write)
          .value();
  interrupt_write(reinterpret_cast<HostPageLayout*>(memory.bytes().data())->instances[index]);
}

InstancePage TestHost::make_page(const std::string& instance, const std::string& task, std::int32_t pid) {
  instances_.push_back(instance);
  TaskIdentity identity;
  identity.name.assign(task);
  identity.interval_ns = 1'000'000;
  auto page = InstancePage::create(pool_name_, instance, std::array{identity}).value();
  InstanceRuntime runtime;
  runtime.pid = pid;
  runtime.running = 1;
  runtime.scheduler.assign("CmpScheduleTimer");
  page.write_runtime(runtime);
  return page;
}

void TestHost::start_server(std::vector<std::string> more) {
  more_arguments_ = std::move(more);
  std::vector<std::string> arguments{"--host",      name_,      "--domain",        std::to_string(domain_),
                                     "--pool",      pool_name_, "--run-directory", run_directory_,
                                     "--interface", "lo",       "--log-level",     "warning"};
  arguments.insert(arguments.end(), more_arguments_.begin(), more_arguments_.end());
  server_ = std::make_unique<Child>(PLCHOST_DDS_PROGRAM, arguments, log_file_);
}

void TestHost::replace_server() {
  server_->signal(SIGKILL);
  server_->wait();
  std::vector<std::string> arguments = more_arguments_;
  if (std::ranges::find(arguments, "--name-held") == arguments.end()) arguments.emplace_back("--name-held");
  start_server(std::move(arguments));
}

std::vector<ControlRequest> TestHost::requests() {
  const std::lock_guard lock(mutex_);
  return requests_;
}

ControlReply TestHost::check_host(const std::string& argument) {
  const std::lock_guard lock(mutex_);
  if (argument.empty()) ++checks_;
  constexpr std::size_t kTinyPart = 200;  // so that there are several
  const std::size_t first = argument.empty() ? 0 : parse_first_finding(argument).value();
  return {.number = 0, .code = ErrorCode::ok, .text = encode_part(checks_, findings_, first, kTinyPart)};
}

ControlReply TestHost::forward(const ControlRequest& request) const {
  auto link = PacketSocket::connect(instance_socket_path(run_directory_, request.instance)).value();
  link.send(encode(request)).value();
  return decode_reply(receive_until(link, soon()).value()).value();
}

void TestHost::serve(PacketListener& listener, const std::stop_token& stop) {
  std::optional<PacketSocket> peer;
  while (!stop.stop_requested()) {
    std::array<pollfd, 2> fds{pollfd{listener.fd(), POLLIN, 0}, pollfd{peer ? peer->fd() : -1, POLLIN, 0}};
    ::poll(fds.data(), fds.size(), 10);
    if (auto accepted = listener.accept(); accepted && *accepted) peer = std::move(**accepted);
    if (close_peer) peer.reset();
    if (!peer) continue;
    auto packet = peer->receive();
    if (!packet) {
      peer.reset();
      continue;
    }
    if (!*packet) continue;
    const ControlRequest request = decode_request(**packet).value();
    ControlReply reply;
    if (request.verb == ControlVerb::check_host) {
      reply = check_host(request.argument);
    } else {
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
        reply = answer_;
      }
      if (forwards) reply = forward(request);
    }
    if (silent) continue;
    while (hold && request.verb == ControlVerb::stop && !stop.stop_requested())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (request.verb == ControlVerb::stop) write_instance(0, request.instance, InstanceState::stopped, 4711);
    reply.number = request.number;
    (void)peer->send(encode(reply));
    if (request.verb != ControlVerb::check_host) ++answered;
  }
}

std::unique_ptr<ControlClient> connect(const OwnDomain& domain) {
  dds::DomainOptions options;
  options.domain = domain.number();
  return ControlClient::connect(options).value();
}

}  // namespace plchost
