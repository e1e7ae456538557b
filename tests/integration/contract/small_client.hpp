#pragma once

#include <iostream>
#include <set>
#include <vector>

#include "party.hpp"

namespace contract {

/// As much of a client as shows that it gets on with a host. Each step prints a line.
class SmallClient {
 public:
  /// `host`: the one to talk to; empty: the first that answers.
  SmallClient(std::uint32_t domain, std::string host) : party_(domain, false), host_(std::move(host)) {
    wait_until([&] { return sees_host(); }, "a host");
    std::cout << "host " << host_ << " api " << present_.api_version << '\n';
    const std::string theirs = "h." + host_;
    requests_ = party_.writer(plc_Request_desc, "plc/v1/op/request",
                              {.transient_local = false, .depth = 0, .partition = theirs});
    posts_ = party_.writer(plc_EventPost_desc, "plc/v1/event",
                           {.transient_local = false, .depth = 0, .partition = theirs});
  }

  [[nodiscard]] const Party& party() const { return party_; }
  [[nodiscard]] const std::string& host() const { return host_; }
  [[nodiscard]] const plc_HostStatus& status() const { return status_; }

  /// Takes `count` samples of this host.
  template <class Sample, class Use>
  void take_status(dds_entity_t reader, std::uint32_t count, const char* what, Use use) const {
    std::uint32_t seen = 0;
    const auto see = [&](const Sample& sample, const auto& /*info*/) {
      if (sample.host != host_) return;
      ++seen;
      use(sample);
    };
    wait_until(
        [&] {
          take<Sample>(reader, see);
          return seen >= count;
        },
        what);
  }

  void list_instances() const {
    std::set<std::string> names;
    const auto reader =
        party_.reader(plc_InstanceStatus_desc, "plc/v1/status/instance", {.depth = 0, .partition = "s.*"});
    take_status<plc_InstanceStatus>(reader, count_of(status_, "instance").value_or(0), "the instances",
                                    [&](const plc_InstanceStatus& one) { names.insert(one.instance); });
    for (const std::string& name : names) std::cout << "instance " << name << '\n';
  }

  plc_Reply ask(std::int32_t operation, const std::string& instance) {
    take<plc_Presence>(presence_, [&](const plc_Presence& news, const auto& /*info*/) {
      if (news.host == host_) present_ = news;
    });
    return call(limit_by(present_), host_, operation, instance, ++last_number_, requests_, replies_, ext_);
  }

  void start(const std::string& instance) {
    const plc_Reply started = ask(plc_OPERATION_START, instance);
    std::cout << "start " << started.code << ' ' << started.text << '\n';
  }

  void post(const std::string& instance, const std::string& event, std::uint64_t count) {
    const auto acks = party_.reader(plc_EventAck_desc, "plc/v1/event_ack", {.partition = party_.partition()});
    plc_EventPost post{};
    post.limit = limit_by(present_);
    const dds_guid_t source = guid_of(posts_);
    std::memcpy(post.source, source.v, sizeof source.v);
    set(post.host, host_);
    set(post.instance, instance);
    set(post.event, event);
    set_ext(post.ext, ext_);
    plc_EventAck ack{};
    Clock::time_point next{};
    const auto post_the_rest = [&] {
      take<plc_EventAck>(acks, [&](const plc_EventAck& news, const auto& /*info*/) { ack = news; });
      if (ack.sequence_number >= count) return true;
      if (Clock::now() < next) return false;
      next = Clock::now() + milliseconds(100);
      const std::uint64_t last = std::min<std::uint64_t>(count, ack.sequence_number + 16);
      for (std::uint64_t number = ack.sequence_number + 1; number <= last; ++number) {
        post.sequence_number = number;
        post.base_sequence = ack.sequence_number + 1;
        (void)dds_write(posts_, &post);
      }
      return false;
    };
    wait_until(post_the_rest, "acknowledgements");
    std::cout << "post accepted " << ack.accepted << " rejected " << ack.rejected << '\n';
  }

  void list_objects() {
    const auto pages =
        party_.reader(plc_ObjectPage_desc, "plc/v1/objects", {.depth = 0, .partition = party_.partition()});
    if (const plc_Reply reply = ask(plc_OPERATION_LIST_OBJECTS, ""); reply.code != 0) {
      std::cout << "objects: code " << reply.code << '\n';
      return;
    }
    std::uint32_t objects = 0;
    const auto count = [&](const plc_ObjectPage& page, const auto& /*info*/) {
      objects += page.objects._length;
    };
    wait_until(
        [&] {
          take<plc_ObjectPage>(pages, count);
          return objects > 0;
        },
        "a page of objects");
    std::cout << "objects listed\n";
  }

 protected:
  /// Of all that it asks for and posts.
  void add_to_ext(std::string_view name, std::string_view value) {
    plc_KeyValue& entry = ext_.emplace_back();
    set(entry.name, name);
    set(entry.value, value);
  }

 private:
  bool sees_host() {
    take<plc_Presence>(presence_, [&](const plc_Presence& news, const auto& /*info*/) {
      if (host_.empty()) host_ = news.host;
      if (news.host == host_) present_ = news;
    });
    take<plc_HostStatus>(hosts_, [&](const plc_HostStatus& news, const auto& /*info*/) {
      if (host_.empty()) host_ = news.host;
      if (news.host == host_) status_ = news;
    });
    return present_.epoch != 0 && status_.epoch == present_.epoch;
  }

  Party party_;
  std::string host_;
  plc_Presence present_{};
  plc_HostStatus status_{};
  std::int64_t last_number_ = 0;
  std::vector<plc_KeyValue> ext_;
  dds_entity_t presence_ =
      party_.reader(plc_Presence_desc, "plc/v1/presence", {.depth = 0, .partition = "s.*"});
  dds_entity_t hosts_ =
      party_.reader(plc_HostStatus_desc, "plc/v1/status/host", {.depth = 0, .partition = "s.*"});
  dds_entity_t replies_ =
      party_.reader(plc_Reply_desc, "plc/v1/reply", {.depth = 0, .partition = party_.partition()});
  dds_entity_t requests_ = 0;
  dds_entity_t posts_ = 0;
};

}  // namespace contract
