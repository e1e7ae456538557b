// Forces a variable for some seconds, and shows others meanwhile, ten times a second:
// hold_variable HOST INSTANCE VARIABLE VALUE SECONDS PATTERN... The domain: PLCHOST_DOMAIN.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <plchost/plchost_client.hpp>

namespace {

void show(const plchost::Client::Sampled& sampled) {
  if (!sampled) std::printf("no sample: %s\n", sampled.text.c_str());
  for (const auto& variable : sampled.sample.variables)
    std::printf("%s=%s%s ", variable.name.c_str(), variable.value.c_str(), variable.forced ? " forced" : "");
  std::printf("%s\n", sampled.sample.consistent ? "" : "of several cycles");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 7) return 2;
  plchost::Client::Options options;
  if (const char* domain = std::getenv("PLCHOST_DOMAIN"))
    options.domain = static_cast<unsigned>(std::atoi(domain));
  options.timeout = std::chrono::seconds(30);  // of a host that is just starting
  plchost::Client client(options);
  const std::string host = argv[1];
  const std::string instance = argv[2];
  const std::vector<std::string> patterns(argv + 6, argv + argc);
  const auto watch = client.watch_variables(host, instance, patterns, std::chrono::milliseconds(100), show);
  client.force_variable(host, instance, argv[3], argv[4]);
  for (const auto& force : client.forces(host, instance))
    std::printf("forced: %s to %s\n", force.name.c_str(), force.forced_value.c_str());
  std::this_thread::sleep_for(std::chrono::seconds(std::atoi(argv[5])));
  client.unforce_variable(host, instance, argv[3]);
  return 0;
} catch (const plchost::ClientError& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
