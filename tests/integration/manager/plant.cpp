#include "tests/integration/manager/plant.hpp"

#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>

#include "api/control/control_handler.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/pages/transition_ring.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/receive_until.hpp"
#include "tests/support/whole_lines.hpp"

namespace plchost {

namespace {

const std::string kBuild = PLCHOST_BUILD_DIRECTORY;
constexpr Duration kPatience = std::chrono::seconds(30);
constexpr Duration kWriteTakes = std::chrono::seconds(2);  // if the writer loses its processor meanwhile

}  // namespace

Plant::Plant() {
  pool_ = own_name("plant");
  folder_ = std::filesystem::temp_directory_path() / pool_;
  std::filesystem::create_directories(folder_);
}

Plant::~Plant() {
  if (testing::Test::HasFailure()) fmt::print("{}\n", log());
  if (manager_.pid != 0) kill_manager();
  kill_instances();
  for (const std::string& name : names_) {
    InstancePage::remove(pool_, name);
    FlightPage::remove(pool_, name);
    TransitionRing::remove(pool_, name);
    MemoryFile::remove(pool_ + ".variables." + name);
    LogRing::remove(pool_, name);
    OutputsPage::remove(pool_, name);
    MemoryFile::remove(pool_ + ".wish." + name);
  }
  MemoryFile::remove(host_page_name(pool_));
  ObjectPool::remove(pool_);
  remove_pool_memories(pool_);
  // An instance that was still being set up has no socket by which it is found, and makes one.
  std::error_code ignored;
  eventually([&] {
    kill_processes_about(folder_);
    std::filesystem::remove_all(folder_, ignored);
    return !std::filesystem::exists(folder_, ignored);
  });
}

void Plant::kill_processes_about(const std::string& text) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ostringstream line;
    line << std::ifstream(entry.path() / "cmdline").rdbuf();
    // A script in place of the API server has the folder as its own.
    std::error_code ignored;
    const std::string folder = std::filesystem::read_symlink(entry.path() / "cwd", ignored);
    const int pid = std::atoi(entry.path().filename().c_str());
    if (pid > 0 && (line.str().contains(text) || folder.starts_with(text))) ::kill(pid, SIGKILL);
  }
}

// Those that outlived their manager: found by their sockets, as a manager would.
void Plant::kill_instances() {
  for (const std::string& name : names_) {
    const auto link = PacketSocket::connect((folder_ / "run" / (name + ".sock")).string());
    if (!link) continue;
    if (auto process = open_process(link->peer_pid().value_or(0))) {
      (void)signal_process(*process, SIGKILL);
      wait_for_end(*process, kPatience);
    }
  }
}

void Plant::lose_memory() const {
  std::error_code ignored;
  for (const std::string& path : leftovers()) std::filesystem::remove_all(path, ignored);
}

std::string Plant::application(const std::string& name) {
  return fmt::format("{}/applications/{}.so", kBuild, name);
}

void Plant::add(const std::string& name, const std::string& application_name, const std::string& more_keys) {
  instances_ +=
      fmt::format("[[instance]]\nname = \"{}\"\ncore = 0\nshare_core = true\napplication = \"{}\"\n{}\n",
                  name, application(application_name), more_keys);
  names_.push_back(name);
}

void Plant::write_file(const std::string& name, const std::string& text) const {
  std::ofstream(folder_ / name) << text;
}

std::string Plant::text_of(const std::string& name) const {
  std::ostringstream text;
  text << std::ifstream(folder_ / name, std::ios::binary).rdbuf();
  return text.str();
}

std::vector<std::string> Plant::lines_of(const std::string& name) const {
  return whole_lines(folder_ / name);
}

void Plant::use_api_server(const std::string& script) {
  api_server_ = true;
  write_file("plchost-dds", fmt::format("#!/bin/sh\ncd {}\n{}", folder_.string(), script));
  std::filesystem::permissions(folder_ / "plchost-dds", std::filesystem::perms::owner_all);
  std::filesystem::create_symlink(kBuild + "/bin/plc-instance", folder_ / "plc-instance");
}

std::string Plant::configuration() const {
  return fmt::format(
      "[host]\nname = \"cell\"\nrun_directory = \"{}\"\nstate_directory = \"{}\"\npool = "
      "\"{}\"\n{}\n[dds]\nenabled = {}\n{}",
      (folder_ / "run").string(), (folder_ / "state").string(), pool_, host_keys_, api_server_, instances_);
}

void Plant::write_configuration() const {
  write_configuration(configuration());
}

void Plant::start_manager(int output_fd) {
  const std::string config = (folder_ / "cell.toml").string();
  write_configuration();
  const UniqueFd log(::open((folder_ / "log").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC,
                            0600));  // NOLINT: variadic
  std::vector<std::string> arguments = {kBuild + "/bin/plchostd", "--config", config};
  if (api_server_) arguments.insert(arguments.end(), {"--programs", folder_.string()});
  auto process = spawn_process({.arguments = arguments, .output_fd = output_fd >= 0 ? output_fd : log.get()});
  ASSERT_TRUE(process) << process.error().describe();
  manager_ = std::move(*process);
  ASSERT_TRUE(eventually([&] {
    const auto link = PacketSocket::connect(manager_socket_path((folder_ / "run").string()));
    return link && link->peer_pid() == manager_.pid;
  })) << this->log();
}

ExitStatus Plant::wait_for_end(ChildProcess& process, Duration limit) {
  pollfd poll{.fd = process.pidfd.get(), .events = POLLIN, .revents = 0};
  const auto wait = std::chrono::duration_cast<std::chrono::milliseconds>(limit).count();
  if (::poll(&poll, 1, static_cast<int>(wait)) != 1) return {.known = false};
  const ExitStatus status = reap_process(process);
  process = {};
  return status;
}

ExitStatus Plant::stop_manager() {
  (void)signal_process(manager_, SIGTERM);
  return wait_for_end(manager_, kPatience);
}

void Plant::kill_manager() {
  (void)signal_process(manager_, SIGKILL);
  wait_for_end(manager_, kPatience);
}

std::string Plant::start_refused_manager() {
  auto pipe = std::move(*make_output_pipe());
  auto process =
      spawn_process({.arguments = {kBuild + "/bin/plchostd", "--config", (folder_ / "cell.toml").string()},
                     .output_fd = pipe.write_end.get()});
  EXPECT_TRUE(process);
  EXPECT_EQ(wait_for_end(*process, kPatience).describe(), "exit code 1");
  constexpr std::size_t kMost = 10'000;
  return read_available(pipe.read_end.get(), kMost);
}

PacketSocket Plant::connect() {
  auto link = PacketSocket::connect(manager_socket_path((folder_ / "run").string()));
  EXPECT_TRUE(link);
  return link ? std::move(*link) : PacketSocket();
}

ControlReply Plant::ask(ControlVerb verb, const std::string& instance, const std::string& argument) {
  auto link = connect();
  EXPECT_TRUE(link.send(
      encode(ControlRequest{.number = 42, .verb = verb, .instance = instance, .argument = argument})));
  const auto packet = receive_until(link, MonotonicClock::now() + kPatience);
  if (!packet) return {.number = 0, .code = ErrorCode::timed_out, .text = packet.error().describe()};
  const auto reply = decode_reply(*packet);
  return reply ? *reply : ControlReply{.number = 0, .code = ErrorCode::corrupt, .text = *packet};
}

InstanceStatus Plant::status(const std::string& instance) {
  InstanceStatus found;
  (void)within(kWriteTakes, [&] {
    const auto page = HostPageReader::open(pool_);
    bool is_whole = true;
    for (std::uint32_t i = 0; page && i < kMaxInstances; ++i) {
      const auto status = page->instance(i);
      if (status && status->name.view() == instance) {
        found = *status;
        return true;
      }
      is_whole = is_whole && (status || page->instance_sequence(i) == 0);
    }
    return is_whole;
  });
  return found;
}

bool Plant::eventually(const std::function<bool()>& condition) {
  return within(kPatience, condition);
}

bool Plant::within(Duration limit, const std::function<bool()>& condition) {
  const TimePoint end = MonotonicClock::now() + limit;
  while (!condition()) {
    if (MonotonicClock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

bool Plant::wait_for(const std::string& instance, InstanceState state) {
  const bool reached = eventually([&] { return status(instance).state == state; });
  EXPECT_TRUE(reached) << instance << " is " << to_string(status(instance).state) << " where "
                       << to_string(state) << " was awaited: " << status(instance).problem.view();
  return reached;
}

TaskCounters Plant::counters(const std::string& instance) {
  TaskCounters sum{};
  (void)within(kWriteTakes, [&] {
    sum = {};
    bool is_whole = true;
    const auto page = InstancePageReader::open(pool_, instance);
    for (std::uint32_t i = 0; page && i < page->task_count(); ++i) {
      const auto task = page->task(i);
      is_whole = is_whole && task.has_value();
      if (!task) continue;
      sum.cycles += task->counters.cycles;
      sum.lost_cycles += task->counters.lost_cycles;
    }
    return is_whole;
  });
  return sum;
}

std::uint64_t Plant::cycles_of(const std::string& instance, std::string_view task) {
  std::uint64_t cycles = 0;
  (void)within(kWriteTakes, [&] {
    const auto page = InstancePageReader::open(pool_, instance);
    for (std::uint32_t i = 0; page && i < page->task_count(); ++i) {
      const auto found = page->task(i);
      if (!found || found->identity.name.view() != task) continue;
      cycles = found->counters.cycles;
      return true;
    }
    return false;
  });
  return cycles;
}

bool Plant::wait_for_cycles(const std::string& instance, std::uint64_t more) {
  const std::uint64_t before = cycles(instance);
  return eventually([&] { return cycles(instance) >= before + more; });
}

int Plant::processes_about(const std::string& text) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ostringstream line;
    line << std::ifstream(entry.path() / "cmdline").rdbuf();
    if (line.str().find(text) != std::string::npos) ++count;
  }
  return count;
}

std::vector<std::string> Plant::leftovers() const {
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(pool_)) found.push_back(entry.path().string());
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "run")) {
    found.push_back(entry.path().string());
  }
  return found;
}

}  // namespace plchost
