#pragma once

#include "party.hpp"

namespace contract {

/// As little of a host as a client can ask for: one instance "press", which can be started and posted to.
class SmallHost {
 public:
  SmallHost(std::uint32_t domain, std::string name) : party_(domain, true), name_(std::move(name)) {
    set(status_.host, name_);
    status_.epoch = 1;
    status_.round = 1;
    set(status_.counts[0].topic, "instance");
    status_.counts[0].samples = 1;
    set(status_.version, "0.0.1");
    set(press_.host, name_);
    set(press_.instance, "press");
    press_.epoch = 1;
    press_.state = 3;
    set(presence_.host, name_);
    presence_.epoch = 1;
    presence_.pid = ::getpid();
    presence_.api_version = 1;
  }
  SmallHost(const SmallHost&) = delete;
  SmallHost& operator=(const SmallHost&) = delete;
  virtual ~SmallHost() = default;

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

 protected:
  virtual void write_status() {
    (void)dds_write(instance_writer_, &press_);
    (void)dds_write(host_writer_, &status_);
  }
  /// Does what this host can do more, and may answer with a text. false: it does not know that operation.
  virtual bool does(const plc_Request& /*request*/, plc_Reply& /*reply*/) { return false; }

  [[nodiscard]] const Party& party() const { return party_; }
  [[nodiscard]] plc_HostStatus& status() { return status_; }
  [[nodiscard]] plc_InstanceStatus& press() { return press_; }
  [[nodiscard]] std::string status_partition() const { return "s." + name_; }
  /// Of the client that is being answered.
  [[nodiscard]] const std::string& reply_partition() const { return reply_partition_; }

 private:
  /// The partition of the client that wrote a sample.
  [[nodiscard]] std::string client_of(dds_entity_t reader, const dds_sample_info_t& info) const {
    auto* const writer = dds_get_matched_publication_data(reader, info.publication_handle);
    if (writer == nullptr) return "";
    const std::string partition = "c." + hex(writer->participant_key) + "/" + name_;
    dds_builtintopic_free_endpoint(writer);
    return partition;
  }
  void answer(const plc_Request& request, const dds_sample_info_t& info) {
    const std::string client = client_of(requests_, info);
    if (client != reply_partition_) {
      reply_partition_ = client;
      reply_writer_ = party_.writer(plc_Reply_desc, "plc/v1/reply", {.depth = 16, .partition = client});
    }
    // One that is repeated is answered again, not done again.
    const plc_SampleIdentity& identity = request.header.request_identity;
    if (std::memcmp(&last_reply_.header.related_identity, &identity, sizeof identity) == 0) {
      (void)dds_write(reply_writer_, &last_reply_);
      return;
    }
    plc_Reply reply{};
    reply.header.related_identity = identity;
    set(reply.host, name_);
    if (request.operation == plc_OPERATION_START) {
      press_.state = 2;
      ++status_.round;
      write_status();
    } else if (!does(request, reply)) {
      reply.code = 10;
      reply.header.remote_ex = 5;
      set(reply.text, "unknown operation");
    }
    reply.status_round = status_.round;
    last_reply_ = reply;
    (void)dds_write(reply_writer_, &last_reply_);
  }
  void count(const plc_EventPost& post, const dds_sample_info_t& info) {
    const std::string client = client_of(posts_, info);
    if (client != ack_partition_) {
      ack_partition_ = client;
      ack_writer_ = party_.writer(plc_EventAck_desc, "plc/v1/event_ack", {.partition = client});
      ack_ = {};
    }
    std::memcpy(ack_.source, post.source, sizeof post.source);
    set(ack_.host, name_);
    ack_.epoch = 1;
    ack_.credits = 8;
    if (post.sequence_number == ack_.sequence_number + 1) {
      ack_.sequence_number = post.sequence_number;
      ++ack_.accepted;
    }
    (void)dds_write(ack_writer_, &ack_);
  }

  Party party_;
  std::string name_;
  dds_entity_t presence_writer_ = party_.writer(plc_Presence_desc, "plc/v1/presence",
                                                {.partition = status_partition(), .deadline = true});
  dds_entity_t host_writer_ =
      party_.writer(plc_HostStatus_desc, "plc/v1/status/host", {.partition = status_partition()});
  dds_entity_t instance_writer_ =
      party_.writer(plc_InstanceStatus_desc, "plc/v1/status/instance", {.partition = status_partition()});
  dds_entity_t requests_ = party_.reader(plc_Request_desc, "plc/v1/op/request",
                                         {.transient_local = false, .depth = 0, .partition = "h." + name_});
  dds_entity_t posts_ = party_.reader(plc_EventPost_desc, "plc/v1/event",
                                      {.transient_local = false, .depth = 0, .partition = "h." + name_});
  dds_entity_t reply_writer_ = 0;
  dds_entity_t ack_writer_ = 0;
  std::string reply_partition_;
  std::string ack_partition_;
  plc_Reply last_reply_{};
  plc_Presence presence_{};
  plc_HostStatus status_{};
  plc_InstanceStatus press_{};
  plc_EventAck ack_{};
};

/// Runs a program's main: prints a failure and returns the exit code.
template <class Run>
int run_program(const char* name, Run run) {
  (void)std::signal(SIGTERM, [](int) { asked_to_end = 1; });
  try {
    run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 2;
  }
}

}  // namespace contract
