#include "api/server/status/transition_publisher.hpp"

#include <utility>

#include <sys/stat.h>

#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "shm/files/memory_file.hpp"

namespace plchost {

namespace {

constexpr Duration kRingRetry = std::chrono::milliseconds(100);

ino_t file_of(const std::string& pool, const std::string& instance) {
  struct stat status{};
  return ::stat(MemoryFile::path(transition_ring_name(pool, instance)).c_str(), &status) == 0 ? status.st_ino
                                                                                              : 0;
}

}  // namespace

Result<TransitionPublisher> TransitionPublisher::create(dds_entity_t participant, dds_entity_t publisher,
                                                        Source source) {
  PLCHOST_TRY_ASSIGN(auto way, dds::open_writer(participant, publisher, dds::kTransition));
  return TransitionPublisher(std::move(source), std::move(way));
}

std::uint64_t TransitionPublisher::publish(const std::string& instance, TimePoint now) {
  Followed& followed = followed_[instance];
  follow(instance, followed, now);
  return followed.written;
}

void TransitionPublisher::follow(const std::string& instance, Followed& followed, TimePoint now) {
  if (!followed.ring) {
    if (now < followed.next_look) return;
    followed.next_look = now + kRingRetry;
    followed.file = file_of(source_.pool, instance);
    auto opened = TransitionRingReader::open(source_.pool, instance);
    if (!opened) return;
    followed.ring = *std::move(opened);
  }
  for (;;) {
    if (!followed.unsent) followed.unsent = followed.ring->next(now);
    if (!followed.unsent) break;
    if (!write(instance, followed.ring->stream_unix_ns(), *followed.unsent)) return;
    followed.written = followed.unsent->sequence;
    followed.unsent.reset();
  }
  // The manager makes a damaged ring anew, and all write into that.
  if (now < followed.next_look) return;
  followed.next_look = now + kRingRetry;
  const ino_t file = file_of(source_.pool, instance);
  if (file != 0 && file != followed.file) followed.ring.reset();
}

bool TransitionPublisher::write(const std::string& instance, std::int64_t stream,
                                const Transition& transition) {
  plc_Transition sample{};
  dds::copy_text(sample.host, source_.host);
  dds::copy_text(sample.instance, instance);
  sample.epoch = source_.epoch;
  sample.stream = static_cast<std::uint64_t>(stream);
  sample.sequence_number = transition.sequence;
  sample.time_unix_ns = transition.time_unix_ns;
  sample.time_monotonic_ns = transition.time_monotonic_ns;
  sample.source = static_cast<std::uint32_t>(transition.source);
  sample.from_state = transition.from;
  sample.to_state = transition.to;
  sample.pid = transition.pid;
  dds::copy_text(sample.reason, transition.reason.view());
  return dds_write(way_.writer.get(), &sample) == DDS_RETCODE_OK;
}

}  // namespace plchost
