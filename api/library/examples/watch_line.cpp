// Shows hosts, changes of state and tasks as they come, for some seconds: watch_line SECONDS. The domain:
// PLCHOST_DOMAIN.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <plchost/plchost_client.hpp>

namespace {

void show_host(const plchost::Client::Host& host) {
  std::printf("host %s %s\n", host.name.c_str(), host.answers ? "answers" : "is silent");
  std::fflush(stdout);
}

void show_transition(const plchost::Client::Transition& change) {
  std::printf("%s/%s: %s %s -> %s %s\n", change.host.c_str(), change.instance.c_str(), change.of.c_str(),
              change.from_state.c_str(), change.to_state.c_str(), change.reason.c_str());
  std::fflush(stdout);
}

void show_task(const plchost::Client::Task& task) {
  std::printf("%s/%s/%s: %llu cycles\n", task.host.c_str(), task.instance.c_str(), task.name.c_str(),
              task.cycles);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  plchost::Client::Options options;
  if (const char* domain = std::getenv("PLCHOST_DOMAIN"))
    options.domain = static_cast<unsigned>(std::atoi(domain));
  plchost::Client client(options);
  const auto hosts = client.watch_hosts(show_host);
  const auto transitions = client.watch_transitions("", show_transition);
  const auto tasks = client.watch_tasks("", show_task);
  std::this_thread::sleep_for(std::chrono::seconds(std::atoi(argv[1])));
  return 0;
} catch (const plchost::ClientError& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
