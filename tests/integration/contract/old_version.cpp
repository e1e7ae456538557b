// Programs as they were built when version 1 was made: from control_v1.idl and Cyclone DDS, and nothing else
// of plchost.
//
//   old_version client DOMAIN HOST INSTANCE EVENT COUNT
//       lists instances, starts one, posts, asks for the objects
//
//   old_version host DOMAIN
//       host "old" with instance "press": until SIGTERM

#include "small_client.hpp"
#include "small_host.hpp"

int main(int argc, char** argv) {
  return contract::run_program("old_version", [&] {
    const std::string verb = argc > 2 ? argv[1] : "";
    const std::uint32_t domain = argc > 2 ? static_cast<std::uint32_t>(std::stoul(argv[2])) : 0;
    if (verb == "host" && argc == 3) return contract::SmallHost(domain, "old").run();
    if (verb != "client" || argc != 7) {
      throw std::invalid_argument("client DOMAIN HOST INSTANCE EVENT COUNT, or host DOMAIN");
    }
    contract::SmallClient client(domain, argv[3]);
    client.list_instances();
    client.start(argv[4]);
    client.post(argv[4], argv[5], std::stoull(argv[6]));
    client.list_objects();
  });
}
