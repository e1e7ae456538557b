#include "tests/integration/instances/instance_process.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/variables/symbol_page.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost::testing {

std::string application(const std::string& name) {
  return fmt::format("{}/{}.so", APPLICATIONS, name);
}

bool eventually(const std::function<bool()>& condition) {
  using namespace std::chrono_literals;
  const auto give_up = MonotonicClock::now() + 20s;
  while (MonotonicClock::now() < give_up) {
    if (condition()) return true;
    std::this_thread::sleep_for(5ms);
  }
  return condition();
}

Sandbox::Sandbox()
    : pool_(own_name("instance")), folder_((std::filesystem::temp_directory_path() / pool_).string()) {
  std::filesystem::create_directories(folder_);
}

Sandbox::~Sandbox() {
  ObjectPool::remove(pool_);
  remove_pool_memories(pool_);
  for (const char* instance : {"line1", "line2", "line3"}) {
    InstancePage::remove(pool_, instance);
    FlightPage::remove(pool_, instance);
    TransitionRing::remove(pool_, instance);
    SymbolPage::remove(pool_, instance);
    OutputsPage::remove(pool_, instance);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string Sandbox::write(const std::string& name, const std::string& text) const {
  std::string path = folder_ + "/" + name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

InstanceProcess::InstanceProcess(const Sandbox& sandbox, const std::vector<std::string>& arguments,
                                 const std::vector<std::string>& environment)
    : sandbox_(sandbox),
      log_file_(sandbox.folder() + "/" + own_name("log")),
      pool_(ObjectPool::create(sandbox.pool()).value()) {
  std::vector<std::string> all{PLC_INSTANCE};
  const std::array<std::array<std::string, 2>, 3> defaults{
      {{"--name", "line1"}, {"--pool", sandbox.pool()}, {"--run-directory", sandbox.folder()}}};
  for (const auto& option : defaults) {
    if (std::ranges::find(arguments, option[0]) == arguments.end())
      all.insert(all.end(), option.begin(), option.end());
  }
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& argument : all) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::vector<std::string> own = environment;
  std::vector<char*> envp;
  for (char** variable = environ; *variable != nullptr; ++variable) envp.push_back(*variable);
  for (std::string& variable : own) envp.push_back(variable.data());
  envp.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr mode_t kMode = 0600;
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log_file_.c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                   kMode);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  const int error = posix_spawn(&pid_, PLC_INSTANCE, &actions, nullptr, argv.data(), envp.data());
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) pid_ = -1;
  EXPECT_EQ(error, 0);
}

InstanceProcess::~InstanceProcess() {
  if (pid_ > 0) end(SIGKILL);
}

int InstanceProcess::end(int signal) {
  if (signal != 0) ::kill(pid_, signal);
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

void InstanceProcess::wait_until_up(bool running) {
  const bool up = eventually([&] {
    const auto page = InstancePageReader::open(sandbox_.pool(), "line1");
    if (!page) return false;
    const auto runtime = page->runtime();
    return runtime && runtime->pid == pid_ && (runtime->running != 0) == running;
  });
  EXPECT_TRUE(up) << log();
}

std::string InstanceProcess::log() const {
  std::ostringstream text;
  text << std::ifstream(log_file_).rdbuf();
  return text.str();
}

std::string InstanceProcess::last_line_from(std::string_view begin) const {
  const std::string all = log();
  const std::size_t at = all.rfind(begin);
  const std::size_t end = at == std::string::npos ? at : all.find('\n', at);
  return end == std::string::npos ? "" : all.substr(at, end - at);
}

std::optional<TaskSnapshot> InstanceProcess::task(const std::string& name) const {
  constexpr Duration kWriteTakes = std::chrono::seconds(2);  // if its task loses the processor meanwhile
  std::optional<TaskSnapshot> found;
  const TimePoint end = MonotonicClock::now() + kWriteTakes;
  for (bool is_whole = false; !found && !is_whole && MonotonicClock::now() < end;) {
    const auto page = InstancePageReader::open(sandbox_.pool(), "line1");
    is_whole = true;
    for (std::uint32_t i = 0; page && !found && i < page->task_count(); ++i) {
      auto task = page->task(i);
      is_whole = is_whole && task.has_value();
      if (task && task->identity.name.view() == name) found = std::move(task);
    }
  }
  return found;
}

InstanceRuntime InstanceProcess::runtime() const {
  std::optional<InstanceRuntime> runtime;
  const bool is_read = eventually([&] {
    const auto page = InstancePageReader::open(sandbox_.pool(), "line1");
    if (page) runtime = page->runtime();
    return runtime.has_value();
  });
  EXPECT_TRUE(is_read) << log();
  return runtime.value_or(InstanceRuntime{});
}

PacketSocket InstanceProcess::connect() const {
  std::optional<PacketSocket> socket;
  const bool connected = eventually([&] {
    auto attempt = PacketSocket::connect(instance_socket_path(sandbox_.folder(), "line1"));
    if (attempt) socket = *std::move(attempt);
    return attempt.has_value();
  });
  EXPECT_TRUE(connected) << log();
  return std::move(socket).value_or(PacketSocket());
}

ControlReply InstanceProcess::ask(ControlVerb verb, const std::string& argument) const {
  using namespace std::chrono_literals;
  PacketSocket socket = connect();
  EXPECT_TRUE(socket.send(encode(ControlRequest{77, verb, "line1", argument})));
  const auto packet = receive_until(socket, MonotonicClock::now() + 20s);
  if (!packet) return {.number = 0, .code = packet.error().code, .text = packet.error().describe()};
  return decode_reply(*packet).value_or(
      ControlReply{.number = 0, .code = ErrorCode::corrupt, .text = *packet});
}

PoolEvent InstanceProcess::event(const std::string& name) {
  // A handle on pool_'s mapping, which lives as long as this object.
  const auto found = pool_.create_event("line1/" + name);
  EXPECT_TRUE(found);
  return found.value_or(PoolEvent());
}

InstanceProcess::Figures InstanceProcess::figures() {
  const std::string key = "application: ticks ";
  const std::size_t before = log().size();
  EXPECT_EQ(event("report").post(), PostResult::posted);
  std::string fresh;
  const bool seen = eventually([&] {
    fresh = log().substr(before);
    const std::size_t at = fresh.find(key);
    return at != std::string::npos && fresh.find('\n', at) != std::string::npos;
  });
  EXPECT_TRUE(seen) << log();
  Figures figures{};
  const std::size_t at = fresh.find(key);
  if (at == std::string::npos) return figures;
  EXPECT_EQ(std::sscanf(fresh.c_str() + at, "application: ticks %u edges %u works %u loops %u",
                        &figures.ticks, &figures.edges, &figures.works, &figures.loops),
            4);
  return figures;
}

}  // namespace plchost::testing
