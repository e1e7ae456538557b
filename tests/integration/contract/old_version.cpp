// Programs as they were built when version 1 was made: from control_v1.idl and Cyclone DDS, and nothing else
// of plchost.
//   old_version client DOMAIN INSTANCE EVENT COUNT   lists hosts and instances, starts one, posts, asks for
//   the objects old_version host DOMAIN                          host "old" with instance "press": until
//   SIGTERM

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include <dds/dds.h>
#include <unistd.h>

#include "control_v1.h"

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

volatile std::sig_atomic_t asked_to_end = 0;

dds_entity_t made(dds_entity_t entity, const char* what) {
  if (entity < 0) throw std::runtime_error(std::string(what) + ": " + dds_strretcode(entity));
  return entity;
}

void wait_until(const std::function<bool()>& happened, const char* what) {
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

std::uint32_t count_of(const plc_HostStatus& host, std::string_view topic) {
  for (const plc_TopicCount& count : host.counts) {
    if (topic == count.topic) return count.samples;
  }
  return 0;
}

std::string hex(const dds_guid_t& guid) {
  std::string text;
  for (const unsigned byte : guid.v) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", byte);
    text += digits.data();
  }
  return text;
}

dds_guid_t guid_of(dds_entity_t entity) {
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

/// By the presence of a host that has just been taken: for as long as wait_until() waits.
plc_TimeLimit limit_by(const plc_Presence& presence) {
  constexpr std::int64_t kNanoseconds = 15'000'000'000;
  return {presence.epoch, presence.clock_ns + kNanoseconds};
}

/// One request, repeated until it is answered.
plc_Reply call(const plc_TimeLimit& limit, const std::string& host, std::int32_t operation,
               const std::string& instance, std::int64_t number, dds_entity_t writer, dds_entity_t replies) {
  plc_Request request{};
  request.limit = limit;
  const dds_guid_t guid = guid_of(writer);
  std::memcpy(request.header.request_identity.writer_guid, guid.v, sizeof guid.v);
  request.header.request_identity.sequence_number = number;
  set(request.header.instance_name, host);
  request.operation = operation;
  set(request.instance, instance);
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

int run_client(std::uint32_t domain, const std::string& instance, const std::string& event,
               std::uint64_t count) {
  const Party party(domain, false);
  const auto presence = party.reader(plc_Presence_desc, "plc/v1/presence", {.partition = "s.*"});
  const auto hosts = party.reader(plc_HostStatus_desc, "plc/v1/status/host", {.partition = "s.*"});
  const auto instances =
      party.reader(plc_InstanceStatus_desc, "plc/v1/status/instance", {.depth = 0, .partition = "s.*"});
  plc_Presence present{};
  plc_HostStatus host{};
  wait_until(
      [&] {
        take<plc_Presence>(presence, [&](const plc_Presence& news, const auto&) { present = news; });
        take<plc_HostStatus>(hosts, [&](const plc_HostStatus& news, const auto&) { host = news; });
        return present.epoch != 0 && host.epoch == present.epoch;
      },
      "a host");
  std::cout << "host " << host.host << " api " << present.api_version << '\n';
  std::uint32_t seen = 0;
  wait_until(
      [&] {
        take<plc_InstanceStatus>(instances, [&](const plc_InstanceStatus& status, const auto&) {
          ++seen;
          std::cout << "instance " << status.instance << '\n';
        });
        return seen >= count_of(host, "instance");
      },
      "the instances");

  const std::string own = party.partition();
  const std::string theirs = std::string("h.") + host.host;
  const auto replies = party.reader(plc_Reply_desc, "plc/v1/reply", {.depth = 0, .partition = own});
  const auto requests = party.writer(plc_Request_desc, "plc/v1/op/request",
                                     {.transient_local = false, .depth = 0, .partition = theirs});
  const auto pages = party.reader(plc_ObjectPage_desc, "plc/v1/objects", {.depth = 0, .partition = own});
  take<plc_Presence>(presence, [&](const plc_Presence& news, const auto&) { present = news; });
  const plc_TimeLimit limit = limit_by(present);
  const plc_Reply started = call(limit, host.host, plc_OPERATION_START, instance, 1, requests, replies);
  std::cout << "start " << started.code << ' ' << started.text << '\n';

  const auto acks = party.reader(plc_EventAck_desc, "plc/v1/event_ack", {.partition = own});
  const auto posts = party.writer(plc_EventPost_desc, "plc/v1/event",
                                  {.transient_local = false, .depth = 0, .partition = theirs});
  plc_EventPost post{};
  post.limit = limit;
  const dds_guid_t source = guid_of(posts);
  std::memcpy(post.source, source.v, sizeof source.v);
  set(post.host, host.host);
  set(post.instance, instance);
  set(post.event, event);
  plc_EventAck ack{};
  Clock::time_point next{};
  wait_until(
      [&] {
        take<plc_EventAck>(acks, [&](const plc_EventAck& news, const auto&) { ack = news; });
        if (ack.sequence_number >= count) return true;
        if (Clock::now() < next) return false;
        next = Clock::now() + milliseconds(100);
        const std::uint64_t last = std::min<std::uint64_t>(count, ack.sequence_number + 16);
        for (std::uint64_t number = ack.sequence_number + 1; number <= last; ++number) {
          post.sequence_number = number;
          post.base_sequence = ack.sequence_number + 1;
          (void)dds_write(posts, &post);
        }
        return false;
      },
      "acknowledgements");
  std::cout << "post accepted " << ack.accepted << " rejected " << ack.rejected << '\n';

  (void)call(limit, host.host, plc_OPERATION_LIST_OBJECTS, "", 2, requests, replies);
  std::uint32_t objects = 0;
  wait_until(
      [&] {
        take<plc_ObjectPage>(
            pages, [&](const plc_ObjectPage& page, const auto&) { objects += page.objects._length; });
        return objects > 0;
      },
      "a page of objects");
  std::cout << "objects " << (objects > 0 ? "listed" : "none") << '\n';
  return 0;
}

/// As little of a host as a client of today can ask for.
class OldHost {
 public:
  explicit OldHost(std::uint32_t domain) : party_(domain, true) {
    set(status_.host, "old");
    status_.epoch = 1;
    status_.round = 1;
    set(status_.counts[0].topic, "instance");
    status_.counts[0].samples = 1;
    set(status_.version, "0.0.1");
    set(press_.host, "old");
    set(press_.instance, "press");
    press_.epoch = 1;
    press_.state = 3;
    set(presence_.host, "old");
    presence_.epoch = 1;
    presence_.pid = ::getpid();
    presence_.api_version = 1;
  }

  void run() {
    write_status();
    while (asked_to_end == 0) {
      (void)dds_write(presence_writer_, &presence_);
      take<plc_Request>(requests_,
                        [this](const plc_Request& request, const auto& info) { answer(request, info); });
      take<plc_EventPost>(posts_, [this](const plc_EventPost& post, const auto& info) { count(post, info); });
      std::this_thread::sleep_for(milliseconds(10));
    }
  }

 private:
  void write_status() {
    (void)dds_write(instance_writer_, &press_);
    (void)dds_write(host_writer_, &status_);
  }
  /// The partition of the client that wrote a sample.
  static std::string client_of(dds_entity_t reader, const dds_sample_info_t& info) {
    auto* const writer = dds_get_matched_publication_data(reader, info.publication_handle);
    if (writer == nullptr) return "";
    const std::string partition = "c." + hex(writer->participant_key) + "/old";
    dds_builtintopic_free_endpoint(writer);
    return partition;
  }
  void answer(const plc_Request& request, const dds_sample_info_t& info) {
    const std::string client = client_of(requests_, info);
    if (client != reply_partition_) {
      reply_partition_ = client;
      reply_writer_ = party_.writer(plc_Reply_desc, "plc/v1/reply", {.depth = 16, .partition = client});
    }
    plc_Reply reply{};
    reply.header.related_identity = request.header.request_identity;
    set(reply.host, "old");
    if (request.operation == plc_OPERATION_START) {
      press_.state = 2;
      ++status_.round;
      write_status();
    } else {
      reply.code = 10;
      reply.header.remote_ex = 5;
      set(reply.text, "unknown operation");
    }
    reply.status_round = status_.round;
    (void)dds_write(reply_writer_, &reply);
  }
  void count(const plc_EventPost& post, const dds_sample_info_t& info) {
    const std::string client = client_of(posts_, info);
    if (client != ack_partition_) {
      ack_partition_ = client;
      ack_writer_ = party_.writer(plc_EventAck_desc, "plc/v1/event_ack", {.partition = client});
      ack_ = {};
    }
    std::memcpy(ack_.source, post.source, sizeof post.source);
    set(ack_.host, "old");
    ack_.epoch = 1;
    ack_.credits = 8;
    if (post.sequence_number == ack_.sequence_number + 1) {
      ack_.sequence_number = post.sequence_number;
      ++ack_.accepted;
    }
    (void)dds_write(ack_writer_, &ack_);
  }

  Party party_;
  dds_entity_t presence_writer_ =
      party_.writer(plc_Presence_desc, "plc/v1/presence", {.partition = "s.old", .deadline = true});
  dds_entity_t host_writer_ =
      party_.writer(plc_HostStatus_desc, "plc/v1/status/host", {.partition = "s.old"});
  dds_entity_t instance_writer_ =
      party_.writer(plc_InstanceStatus_desc, "plc/v1/status/instance", {.partition = "s.old"});
  dds_entity_t requests_ = party_.reader(plc_Request_desc, "plc/v1/op/request",
                                         {.transient_local = false, .depth = 0, .partition = "h.old"});
  dds_entity_t posts_ = party_.reader(plc_EventPost_desc, "plc/v1/event",
                                      {.transient_local = false, .depth = 0, .partition = "h.old"});
  dds_entity_t reply_writer_ = 0;
  dds_entity_t ack_writer_ = 0;
  std::string reply_partition_;
  std::string ack_partition_;
  plc_Presence presence_{};
  plc_HostStatus status_{};
  plc_InstanceStatus press_{};
  plc_EventAck ack_{};
};

}  // namespace

int main(int argc, char** argv) {
  const std::string verb = argc > 2 ? argv[1] : "";
  try {
    const std::uint32_t domain = argc > 2 ? static_cast<std::uint32_t>(std::stoul(argv[2])) : 0;
    if (verb == "client" && argc == 6) return run_client(domain, argv[3], argv[4], std::stoull(argv[5]));
    if (verb != "host") throw std::invalid_argument("client DOMAIN INSTANCE EVENT COUNT, or host DOMAIN");
    (void)std::signal(SIGTERM, [](int) { asked_to_end = 1; });
    OldHost(domain).run();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "old_version: " << error.what() << '\n';
    return 2;
  }
}
