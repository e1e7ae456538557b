// Two nodes and their routers while a stranger scribbles into their directory and their links: nobody
// crashes, and nothing comes in that was not sent.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "shm/block_driver/block_channel.hpp"
#include "shm/block_driver/block_router.hpp"
#include "shm/log/log.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;

const std::string& pool_of_nodes() {
  static const std::string kName = own_name("fuzz");
  return kName;
}

struct Node {
  std::unique_ptr<BlockNode> node;
  std::unique_ptr<BlockRouter> router;
  std::unique_ptr<BlockChannel> channel;

  explicit Node(const std::string& name) {
    NodeOptions options{.pool = pool_of_nodes(), .entry = {.name = name}};
    options.entry.queue_slots = kMinRingSlots;
    node = std::move(BlockNode::join(options)).value();
    router = std::move(BlockRouter::create(*node)).value();
    channel = std::make_unique<BlockChannel>(BlockChannel::open(*node, "c").value());
  }
};

/// The memories that a stranger has mapped: the directory, and the link from the first node to the second.
void scribble(const Node& a, const Node& b, bool directory, std::size_t place, std::uint8_t value) {
  const std::string link =
      link_name(pool_of_nodes(), "blocks", a.node->address().node, b.node->address().node);
  const auto memory = MemoryFile::open(directory ? pool_of_nodes() + ".memory.blocks" : link, 1,
                                       MemoryFile::Access::read_write);
  if (memory) memory->bytes()[place % memory->bytes().size()] = std::byte{value};
}

void receive(Node& node) {
  static std::vector<std::byte> buffer(kMaxBlockSize);
  Received received;
  if (node.channel->receive(buffer, received) != TakeResult::taken) return;
  const bool all_sent =
      std::all_of(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(received.size),
                  [&](std::byte byte) { return byte == buffer[0]; });
  if (!all_sent) std::abort();
}

}  // namespace

// The input is a list of [ what : 1 ][ place : 3 ][ value : 1 ].
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool kQuiet = (spdlog::set_level(spdlog::level::off), true);
  (void)kQuiet;
  NodeDirectory::remove(pool_of_nodes());
  {
    Node a("a");
    Node b("b");
    TimePoint now = MonotonicClock::now();
    for (; size >= 5; data += 5, size -= 5) {
      const std::size_t place = std::size_t{data[1]} << 16 | std::size_t{data[2]} << 8 | data[3];
      const std::vector<std::byte> contents(place % kMaxBlockSize, std::byte{data[4]});
      switch (data[0] % 8) {
        case 0:
          (void)a.channel->send(b.node->address(), contents);
          break;
        case 1:
          (void)b.channel->send({.host = 0, .node = NodeAddress::kAllNodes}, contents);
          break;
        case 2:
          receive(a);
          receive(b);
          break;
        case 3:
          now += std::chrono::milliseconds(data[4] * 4);
          [[fallthrough]];
        case 4:
          a.router->serve(now);
          b.router->serve(now);
          break;
        default:
          scribble(a, b, data[0] % 2 == 0, place, data[4]);
      }
    }
  }
  NodeDirectory::remove(pool_of_nodes());
  return 0;
}
