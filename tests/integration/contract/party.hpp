// Parts of programs that are built from a contract and Cyclone DDS, and from nothing else of plchost.
// CONTRACT is the header that was made from it.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include <dds/dds.h>
#include <unistd.h>

#include CONTRACT

namespace contract {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

inline volatile std::sig_atomic_t asked_to_end = 0;

inline dds_entity_t made(dds_entity_t entity, const char* what) {
  if (entity < 0) throw std::runtime_error(std::string(what) + ": " + dds_strretcode(entity));
  return entity;
}

inline void wait_until(const std::function<bool()>& happened, const char* what) {
  const auto end = Clock::now() + std::chrono::seconds(15);
  while (!happened()) {
    if (Clock::now() > end) throw std::runtime_error(std::string("in vain waited for ") + what);
    std::this_thread::sleep_for(milliseconds(1));
  }
}

template <std::size_t Size>
void set(char (&text)[Size], std::string_view value) {
  text[value.copy(text, Size - 1)] = '\0';
}

// Nothing: a host that has no such topic.
inline std::optional<std::uint32_t> count_of(const plc_HostStatus& host, std::string_view topic) {
  for (const plc_TopicCount& count : host.counts) {
    if (topic == count.topic) return count.samples;
  }
  return std::nullopt;
}

inline std::string hex(const dds_guid_t& guid) {
  std::string text;
  for (const unsigned byte : guid.v) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", byte);
    text += digits.data();
  }
  return text;
}

inline dds_guid_t guid_of(dds_entity_t entity) {
  dds_guid_t guid{};
  (void)dds_get_guid(entity, &guid);
  return guid;
}

struct Quality {
  bool transient_local = true;
  int depth = 1;  // 0: all
  std::string partition = {};
  bool deadline = false;
};

/// A participant, and what it reads and writes. All of it lives as long as the process.
class Party {
 public:
  Party(std::uint32_t domain, bool server) : participant_(0) {
    const std::string configuration =
        "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
        "multicast=\"false\"/>"
        "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>" +
        std::string(server ? "auto" : "none") +
        "</ParticipantIndex><MaxAutoParticipantIndex>15</MaxAutoParticipantIndex><SPDPInterval>1 "
        "s</SPDPInterval>" +
        (server ? "" : "<Peers><Peer Address=\"127.0.0.1\"/></Peers>") + "</Discovery></Domain></CycloneDDS>";
    made(dds_create_domain(domain, configuration.c_str()), "domain");
    participant_ = made(dds_create_participant(domain, nullptr, nullptr), "participant");
  }
  Party(const Party&) = delete;
  Party& operator=(const Party&) = delete;
  ~Party() { dds_delete(participant_); }

  dds_entity_t reader(const dds_topic_descriptor_t& type, const char* topic, const Quality& quality) const {
    dds_qos_t* const qos = qos_of(quality);
    const dds_entity_t subscriber = made(dds_create_subscriber(participant_, qos, nullptr), "subscriber");
    const dds_entity_t reader = dds_create_reader(subscriber, topic_of(type, topic), qos, nullptr);
    dds_delete_qos(qos);
    return made(reader, topic);
  }
  dds_entity_t writer(const dds_topic_descriptor_t& type, const char* topic, const Quality& quality) const {
    dds_qos_t* const qos = qos_of(quality);
    const dds_entity_t publisher = made(dds_create_publisher(participant_, qos, nullptr), "publisher");
    const dds_entity_t writer = dds_create_writer(publisher, topic_of(type, topic), qos, nullptr);
    dds_delete_qos(qos);
    return made(writer, topic);
  }
  [[nodiscard]] std::string partition() const { return "c." + hex(guid_of(participant_)) + "/*"; }

 private:
  [[nodiscard]] dds_entity_t topic_of(const dds_topic_descriptor_t& type, const char* name) const {
    return made(dds_create_topic(participant_, &type, name, nullptr, nullptr), name);
  }
  static dds_qos_t* qos_of(const Quality& quality) {
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(20));
    dds_qset_durability(qos,
                        quality.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, quality.depth == 0 ? DDS_HISTORY_KEEP_ALL : DDS_HISTORY_KEEP_LAST, quality.depth);
    if (quality.deadline) dds_qset_deadline(qos, DDS_MSECS(75));
    if (!quality.partition.empty()) dds_qset_partition1(qos, quality.partition.c_str());
    return qos;
  }

  dds_entity_t participant_;
};

template <class Sample, class Use>
void take(dds_entity_t reader, Use use) {
  for (;;) {
    std::array<void*, 1> samples{};
    dds_sample_info_t info{};
    if (dds_take(reader, samples.data(), &info, 1, 1) <= 0) return;
    if (info.valid_data) use(*static_cast<const Sample*>(samples[0]), info);
    (void)dds_return_loan(reader, samples.data(), 1);
  }
}

/// An `ext` with these entries, for as long as they stay where they are.
template <class Ext>
void set_ext(Ext& ext, std::span<plc_KeyValue> entries) {
  const auto length = static_cast<std::uint32_t>(entries.size());
  ext = {._maximum = length, ._length = length, ._buffer = entries.data(), ._release = false};
}

/// The value of an entry of `ext`; empty: it is not there.
template <class Ext>
std::string value_in(const Ext& ext, std::string_view name) {
  for (const plc_KeyValue& entry : std::span(ext._buffer, ext._length)) {
    if (name == entry.name) return entry.value;
  }
  return "";
}

/// By the presence of a host that has just been taken: for as long as wait_until() waits.
inline plc_TimeLimit limit_by(const plc_Presence& presence) {
  constexpr std::int64_t kNanoseconds = 15'000'000'000;
  return {presence.epoch, presence.clock_ns + kNanoseconds};
}

/// One request, repeated until it is answered.
inline plc_Reply call(const plc_TimeLimit& limit, const std::string& host, std::int32_t operation,
                      const std::string& instance, std::int64_t number, dds_entity_t writer,
                      dds_entity_t replies, std::span<plc_KeyValue> ext = {}) {
  plc_Request request{};
  request.limit = limit;
  const dds_guid_t guid = guid_of(writer);
  std::memcpy(request.header.request_identity.writer_guid, guid.v, sizeof guid.v);
  request.header.request_identity.sequence_number = number;
  set(request.header.instance_name, host);
  request.operation = operation;
  set(request.instance, instance);
  set_ext(request.ext, ext);
  plc_Reply answer{};
  Clock::time_point next{};
  wait_until(
      [&] {
        if (Clock::now() >= next) {
          (void)dds_write(writer, &request);
          next = Clock::now() + milliseconds(100);
        }
        bool answered = false;
        take<plc_Reply>(replies, [&](const plc_Reply& reply, const auto& /*info*/) {
          if (reply.header.related_identity.sequence_number != number) return;
          answer = reply;
          answered = true;
        });
        return answered;
      },
      "an answer");
  return answer;
}

}  // namespace contract
