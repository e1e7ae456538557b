// Posts an external event: post_event HOST INSTANCE/EVENT. The domain: PLCHOST_DOMAIN.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include <plchost/plchost_client.hpp>

int main(int argc, char** argv) try {
  if (argc != 3) return 2;
  plchost::Client::Options options;
  if (const char* domain = std::getenv("PLCHOST_DOMAIN"))
    options.domain = static_cast<unsigned>(std::atoi(domain));
  options.timeout = std::chrono::seconds(30);  // of a host that is just starting
  plchost::Client client(options);
  const auto run = client.post_and_wait(argv[1], argv[2]);
  std::printf("run by %s, there and back in %lld us\n", run.last_task.c_str(),
              static_cast<long long>(run.round_trip.count() / 1000));
  return 0;
} catch (const plchost::ClientError& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
