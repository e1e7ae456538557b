#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "api/control/application_order.hpp"
#include "api/dds/text.hpp"
#include "api/gateway/block_sample.hpp"
#include "api/server/access/request_check.hpp"
#include "api/server/downloads/download_table.hpp"
#include "api/server/posts/event_intake.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;

/// A host whose shared memory has no name any more: nothing is left when the fuzzer ends.
struct Host {
  std::string name = own_name("fuzz");
  ObjectPool pool = ObjectPool::create(name, {.max_objects = 16}).value();
  PoolEvent event = pool.create_event("line1/ready").value();
  AccessGuard guard;
  EventIntake intake{"hosta", pool, PostLedger::open(pool).value(), 1, guard};

  Host() {
    event.set_registered(true);
    ObjectPool::remove(name);
    MemoryFile::remove(PostLedger::file_name(name));
  }
};

template <class Sample>
Sample sample_from(const std::uint8_t* data, std::size_t size) {
  Sample sample{};
  std::memcpy(&sample, data, std::min(size, sizeof sample));
  sample.ext = {};
  return sample;
}

// Half of the runs have a digest that can be one; bools are no other bytes than those.
void make_possible(plc_Request& request, const std::uint8_t* data, std::size_t size) {
  request.boot = size > 0 && data[0] % 2 == 1;
  request.online = size > 0 && data[0] % 4 >= 2;
  if (size % 2 == 1) dds::copy_text(request.sha256, std::string(64, 'a'));
  request.sha256[sizeof request.sha256 - 1] = '\0';
}

// Pieces of a download: it never has more than was announced, and is complete with exactly that.
void take_chunks(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kSize = 64;
  static DownloadTable table(own_name("downloads"), kSize);
  const TimePoint now = MonotonicClock::now();
  dds::Guid client;
  const plc_SampleIdentity identity{};
  const ControlRequest request{.number = 0,
                               .verb = ControlVerb::download_application,
                               .instance = "line1",
                               .argument = "a.so",
                               .options = {{"size", "64"}, {"sha256", std::string(64, 'a')}}};
  if (!table.begin(client, identity, request, now)) std::abort();
  for (std::size_t at = 0; at + 2 <= size; at += 2) {
    std::array<std::uint8_t, 80> bytes{};
    plc_DownloadChunk chunk{};
    chunk.offset = data[at] % 80U;
    chunk.contents._buffer = bytes.data();
    chunk.contents._length = data[at + 1] % 80U;
    if (data[at] % 8 == 7) client.bytes[0] ^= 1U;
    table.take(chunk, client, now);
    for (const DownloadProgress& progress : table.progress()) {
      if (progress.received > kSize) std::abort();
    }
    if (!table.complete().empty()) break;
    if (!table.given_up(now, [](const dds::Guid&) { return true; }).empty()) break;
  }
  table.end(identity);
  if (table.size() != 0) std::abort();
}

bool names_what_is_there(const ControlRequest& request) {
  const bool of_host = request.verb == ControlVerb::check_host || request.verb == ControlVerb::list_objects ||
                       request.verb == ControlVerb::list_nodes || request.verb == ControlVerb::list_routes ||
                       request.verb == ControlVerb::read_clock || request.verb == ControlVerb::reload_host;
  return request.instance == (of_host ? "" : "line1");
}

// Data of another host goes in only as a block of that host's own nodes, for this one.
void take_block(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint16_t kSender = 2;
  constexpr std::uint16_t kOwn = 1;
  auto block = sample_from<plc_Block>(data, size);
  block.contents = {};
  if (size % 2 == 0) block.source_host = kSender;
  if (size % 4 == 0) block.destination_host = kOwn;
  const auto header = block_header(block, kSender, kOwn);
  if (!header) return;
  const NodeAddress source = NodeAddress::from_number(header->source);
  const NodeAddress destination = NodeAddress::from_number(header->destination);
  const bool for_us = destination.host == kOwn || destination.host == NodeAddress::kAllHosts;
  if (source.host != kSender || source.to_all() || !for_us || !is_sane(*header)) std::abort();
  const plc_Block again = block_sample(*header, block_contents(block), block.sequence_number);
  if (block_header(again, kSender, kOwn) != header) std::abort();
}

}  // namespace

// Any input of a client: a request is refused with a reason or is one that the manager can be given, and a
// post is counted at most once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Host host;
  constexpr std::array<std::string_view, 1> kInstances{"line1"};
  auto request = sample_from<plc_Request>(data, size);
  make_possible(request, data, size);
  take_chunks(data, size);
  for (const ApiRole role : {ApiRole::viewing, ApiRole::operating, ApiRole::engineering}) {
    const auto checked = check_request(request, role, "hosta", kInstances);
    if (checked ? !decode_request(encode(*checked)) || !names_what_is_there(*checked)
                : checked.error().message.empty()) {
      std::abort();
    }
  }
  take_block(data, size);
  auto post = sample_from<plc_EventPost>(data, size);
  post.wait_run = post.late_ack = size % 2 == 1;
  // Half of the runs get as far as the event's name.
  if (size % 2 == 0) {
    dds::copy_text(post.host, "hosta");
    dds::copy_text(post.instance, "line1");
    if (size % 4 == 0) dds::copy_text(post.event, "ready");
  }
  const std::uint64_t before = host.event.counted().count();
  host.intake.process(post);
  host.intake.process(post);
  if (host.event.counted().count() > before + 1) std::abort();
  for (const plc_EventAck& ack : host.intake.collect_acks()) {
    if (ack.accepted + ack.rejected > 0 && ack.sequence_number == 0) std::abort();
  }
  return 0;
}
