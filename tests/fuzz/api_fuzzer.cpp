#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include "api/control/application_order.hpp"
#include "api/dds/text.hpp"
#include "api/gateway/block_sample.hpp"
#include "api/server/access/request_check.hpp"
#include "api/server/downloads/download_table.hpp"
#include "api/server/posts/event_intake.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;
using Input = FuzzedDataProvider;

/// A host whose shared memory has no name any more: nothing is left when the fuzzer ends.
struct Host {
  std::string name = own_name("fuzz");
  ObjectPool pool = ObjectPool::create(name, {.max_objects = 16}).value();
  PoolEvent event = pool.create_event("line1/ready").value();
  AccessGuard guard;
  EventIntake intake{"hosta", pool, PostLedger::open(pool).value(), kEpoch, guard};
  static constexpr std::uint64_t kEpoch = 1;

  Host() {
    event.set_registered(true);
    ObjectPool::remove(name);
    MemoryFile::remove(PostLedger::file_name(name));
  }
};

/// The likely text, or now and then any other.
template <std::size_t Size>
void fill(Input& input, char (&text)[Size], std::string_view likely) {
  constexpr int kOneOf = 8;
  const bool other = input.ConsumeIntegralInRange(1, kOneOf) == 1;
  dds::copy_text(text, other ? input.ConsumeRandomLengthString(Size - 1) : std::string(likely));
}

/// The likely number, or now and then any other.
template <class Number>
Number number(Input& input, Number likely) {
  constexpr int kOneOf = 8;
  return input.ConsumeIntegralInRange(1, kOneOf) == 1 ? input.ConsumeIntegral<Number>() : likely;
}

plc_Request request_from(Input& input) {
  plc_Request request{};
  const std::size_t row = input.ConsumeIntegralInRange<std::size_t>(0, operations().size() - 1);
  const Operation& operation = operations()[row];
  const bool download = operation.options == OperationOptions::download;
  request.operation = number(input, static_cast<std::int32_t>(operation.verb));
  fill(input, request.header.instance_name, "hosta");
  fill(input, request.instance, operation.names_instance ? "line1" : "");
  fill(input, request.sha256, download ? std::string(64, 'a') : std::string());
  request.size = number(input, std::uint64_t{download ? 64U : 0U});
  request.boot = number(input, std::uint8_t{0}) % 2 == 1;
  request.online = number(input, std::uint8_t{0}) % 2 == 1;
  const std::string argument = input.ConsumeRemainingBytesAsString();
  dds::copy_text(request.argument, argument);
  return request;
}

// A request is refused with a reason, or is one that the manager can be given.
void take_request(Input& input) {
  constexpr std::array<std::string_view, 1> kInstances{"line1"};
  const plc_Request request = request_from(input);
  const Operation* const operation = find_operation(request.operation);
  for (const ApiRole role : {ApiRole::viewing, ApiRole::operating, ApiRole::engineering}) {
    const auto checked = check_request(request, role, "hosta", kInstances);
    if (!checked) {
      if (checked.error().message.empty()) std::abort();
      (void)remote_exception(checked.error().code);
      continue;
    }
    if (operation == nullptr || operation->role != role || std::string_view(request_topic(role).name).empty())
      std::abort();
    if (checked->instance != (operation->names_instance ? "line1" : "")) std::abort();
    if (!decode_request(encode(*checked))) std::abort();
  }
  if (operation_name(request.operation).empty()) std::abort();
  if (only_reads(request.operation) && operation == nullptr) std::abort();
}

// The options of a download, as they come to the manager from a process that was taken over.
void take_order(Input& input) {
  std::map<std::string, std::string> options;
  for (const std::string_view name :
       {kSizeOption, kDigestOption, kSourceOption, kByOption, kFromOption, kBootOption}) {
    if (!input.ConsumeBool()) continue;
    options.emplace(name, name == kDigestOption && input.ConsumeBool() ? std::string(64, 'f')
                                                                       : input.ConsumeRandomLengthString(70));
  }
  const auto order = ApplicationOrder::from_options(options);
  if (order && (order->size == 0 || order->digest.size() != 64)) std::abort();
  const std::string name = input.ConsumeRemainingBytesAsString();
  if (check_file_name(name) && (name.empty() || name.find('/') != std::string::npos)) std::abort();
}

// Pieces of a download: it never has more than was announced, and is complete with exactly that.
void take_chunks(Input& input) {
  constexpr std::uint64_t kSize = 64;
  constexpr std::uint32_t kMost = 80;
  static DownloadTable table(own_name("downloads"), kSize);
  TimePoint now = MonotonicClock::now();
  dds::Guid client;
  const plc_SampleIdentity identity{};
  const ControlRequest request{
      .number = 0,
      .verb = ControlVerb::download_application,
      .instance = "line1",
      .argument = "a.so",
      .options = {{"size", std::to_string(number(input, kSize))}, {"sha256", std::string(64, 'a')}}};
  (void)table.begin(client, identity, request, now);
  std::vector<plc_SampleIdentity> others(input.ConsumeIntegralInRange<std::size_t>(0, 6));
  for (std::size_t i = 0; i < others.size(); ++i) {
    ControlRequest other = request;
    other.instance = "line" + std::to_string(number(input, static_cast<std::uint8_t>(i)));
    others[i].sequence_number = static_cast<decltype(others[i].sequence_number)>(i + 1);
    (void)table.begin(client, others[i], other, now);
  }
  while (input.remaining_bytes() > 0) {
    std::array<std::uint8_t, kMost> bytes{};
    plc_DownloadChunk chunk{};
    chunk.offset = input.ConsumeIntegralInRange<std::uint32_t>(0, kMost);
    chunk.contents._buffer = bytes.data();
    chunk.contents._length = input.ConsumeIntegralInRange<std::uint32_t>(0, kMost);
    client.bytes[0] = number(input, std::uint8_t{0});
    now += std::chrono::seconds(number(input, std::uint8_t{0}));
    table.take(chunk, client, now);
    for (const DownloadProgress& progress : table.progress()) {
      if (progress.received > kSize) std::abort();
    }
    if (!table.complete().empty()) break;
    const bool there = number(input, std::uint8_t{1}) % 2 == 1;
    if (!table.given_up(now, [there](const dds::Guid&) { return there; }).empty()) break;
  }
  (void)table.repeat(identity);
  table.end(identity);
  for (const plc_SampleIdentity& other : others) table.end(other);
  if (table.size() != 0) std::abort();
}

// Data of another host goes in only as a block of that host's own nodes, for this one.
void take_block(Input& input) {
  constexpr std::uint16_t kSender = 2;
  constexpr std::uint16_t kOwn = 1;
  plc_Block block{};
  block.source_host = number(input, kSender);
  block.source_node = number(input, std::uint16_t{1});
  block.destination_host = number(input, kOwn);
  block.destination_node = number(input, std::uint16_t{2});
  block.channel = number(input, 1U);
  block.kind = number(input, std::uint8_t{0});
  block.priority = number(input, std::uint8_t{1});
  block.hosts = number(input, std::uint8_t{0});
  std::vector<std::uint8_t> bytes = input.ConsumeRemainingBytes<std::uint8_t>();
  block.contents._buffer = bytes.data();
  block.contents._length = static_cast<std::uint32_t>(bytes.size());
  const auto header = block_header(block, kSender, kOwn);
  if (!header) return;
  const NodeAddress source = NodeAddress::from_number(header->source);
  const NodeAddress destination = NodeAddress::from_number(header->destination);
  const bool for_us = destination.host == kOwn || destination.host == NodeAddress::kAllHosts;
  if (source.host != kSender || source.to_all() || !for_us || !is_sane(*header)) std::abort();
  const plc_Block again = block_sample(*header, block_contents(block), block.sequence_number);
  if (block_header(again, kSender, kOwn) != header) std::abort();
}

template <class Post>
Post post_from(Input& input) {
  Post post{};
  post.source[0] = number(input, std::uint8_t{1});
  post.sequence_number = number(input, std::uint64_t{1});
  post.base_sequence = number(input, std::uint64_t{1});
  fill(input, post.host, "hosta");
  post.limit.epoch = number(input, std::uint64_t{0});
  post.limit.clock_ns = input.ConsumeIntegral<std::int64_t>();
  post.wait_run = input.ConsumeBool();
  post.late_ack = input.ConsumeBool();
  return post;
}

// A post is counted at most once, and answered.
template <class Post>
void take_post(Host& host, const Post& post, std::uint64_t most) {
  const std::uint64_t before = host.event.counted().count();
  host.intake.process(post);
  host.intake.process(post);
  if (host.event.counted().count() > before + most) std::abort();
  for (const plc_EventAck& ack : host.intake.collect_acks()) {
    if (ack.accepted + ack.rejected > 0 && ack.sequence_number == 0) std::abort();
  }
  for (const AwaitedPost& awaited : host.intake.collect_awaited()) {
    if (awaited.targets.size() > most) std::abort();
  }
}

void take_posts(Host& host, Input& input) {
  if (input.ConsumeBool()) {
    auto post = post_from<plc_EventPost>(input);
    fill(input, post.instance, "line1");
    fill(input, post.event, "ready");
    return take_post(host, post, 1);
  }
  auto batch = post_from<plc_EventBatch>(input);
  std::vector<plc_EventName> events(input.ConsumeIntegralInRange<std::size_t>(0, 3));
  for (plc_EventName& event : events) {
    fill(input, event.instance, "line1");
    fill(input, event.event, "ready");
  }
  batch.events._buffer = events.data();
  batch.events._length = static_cast<std::uint32_t>(events.size());
  take_post(host, batch, events.size());
}

}  // namespace

// Samples of a client or of another host. The first byte says of which kind it is.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Host host;
  Input input(data, size);
  constexpr int kKinds = 5;
  switch (input.ConsumeIntegralInRange(1, kKinds)) {
    case 1:
      take_request(input);
      break;
    case 2:
      take_order(input);
      break;
    case 3:
      take_chunks(input);
      break;
    case 4:
      take_block(input);
      break;
    default:
      take_posts(host, input);
  }
  return 0;
}
