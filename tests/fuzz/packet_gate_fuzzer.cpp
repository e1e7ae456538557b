// The gate of an unsecured host, judged by Cyclone: a packet that passes must not end it. Cyclone runs in a
// process of its own, and what a real client has said to it are the seeds. With $PLCHOST_FUZZ_DOMAIN in
// another DDS domain.
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <vector>

#include "api/dds/gate/packet_gate.hpp"
#include "tests/integration/security/cyclone_oracle.hpp"

namespace {

using plchost::CycloneOracle;
using plchost::Packet;

struct Fuzzed {
  std::optional<CycloneOracle> oracle;
  std::vector<Packet> seeds;
  std::uint64_t runs = 0;
};

CycloneOracle start() {
  const char* const domain = std::getenv("PLCHOST_FUZZ_DOMAIN");
  constexpr std::uint32_t kDomain = 214;
  auto oracle = CycloneOracle::start(
      GATED_CYCLONE_PROGRAM,
      domain == nullptr ? kDomain : static_cast<std::uint32_t>(std::strtoul(domain, nullptr, 10)));
  if (oracle) return *std::move(oracle);
  std::fprintf(stderr, "gated_cyclone does not start\n");
  std::exit(1);
}

Fuzzed& fuzzed() {
  static Fuzzed made = [] {
    CycloneOracle oracle = start();
    auto seeds = oracle.seeds();
    return Fuzzed{.oracle = std::move(oracle), .seeds = std::move(seeds)};
  }();
  return made;
}

void feed(const Packet& packet) {
  if (fuzzed().oracle->feed(packet)) return;
  constexpr const char* kFile = "gate.packets";
  fuzzed().oracle->save_last(kFile);
  std::fprintf(stderr, "Cyclone has ended or hangs; its last packet is in %s\n", kFile);
  std::abort();
}

// The rest of a packet is admitted as it is.
bool passes(Packet packet, bool secured) {
  using plchost::dds::Admission;
  if (plchost::dds::admit(packet, secured) == Admission::refused) return false;
  if (plchost::dds::admit(packet, secured) == Admission::whole) return true;
  std::fprintf(stderr, "a packet that the gate has passed does not pass again\n");
  std::abort();
}

}  // namespace

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned int seed) {
  if (seed % 2 == 0) return LLVMFuzzerMutate(data, size, max_size);
  std::mt19937 random(seed);
  const Packet made = plchost::mutated(fuzzed().seeds, random);
  const std::size_t made_size = made.size() < max_size ? made.size() : max_size;
  for (std::size_t i = 0; i < made_size; ++i) data[i] = std::to_integer<std::uint8_t>(made[i]);
  return made_size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(data);
  Packet packet(bytes, bytes + size);
  (void)passes(packet, /*secured=*/true);
  if (passes(packet, /*secured=*/false)) feed(packet);
  // Its participants are forgotten when they are silent.
  constexpr std::uint64_t kAgain = 1000;
  if (fuzzed().runs++ % kAgain == 0) {
    for (const Packet& seed : fuzzed().seeds) feed(seed);
  }
  return 0;
}
