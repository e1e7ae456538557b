#include "api/dds/topics.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <topic_names.hpp>

#include "api/dds/domain.hpp"
#include "api/dds/error.hpp"

namespace plchost::dds {

Qos qos_of(const TopicInfo& topic) {
  Qos qos;
  qos.reliable(topic.qos.blocking);
  if (topic.qos.depth > 0) {
    qos.keep_last(topic.qos.depth);
  } else {
    qos.keep_all();
  }
  if (topic.qos.transient_local) qos.transient_local();
  if (!topic.qos.autodispose) qos.no_autodispose();
  if (topic.qos.deadline > Duration::zero()) qos.deadline(topic.qos.deadline);
  return qos;
}

Qos shown_qos(const TopicInfo& topic) {
  constexpr std::int32_t kOfAllHosts = 8;  // of one key: one of the host itself, and others without a right
  Qos qos = qos_of(topic);
  qos.keep_last(std::max(kOfAllHosts, topic.qos.depth));
  return qos;
}

Qos bounded_qos(const TopicInfo& topic) {
  Qos qos = qos_of(topic);
  if (topic.qos.reader_holds > 0) qos.max_samples(topic.qos.reader_holds);
  return qos;
}

Qos answers_qos(const TopicInfo& topic, std::int32_t each) {
  Qos qos = qos_of(topic);
  qos.keep_all().max_samples(each * kMaxServersPerMachine);
  return qos;
}

std::string name_partition(std::string_view host) {
  return fmt::format("{}{}", topic_names::kNamePartition, host);
}

std::string host_partition(std::string_view host) {
  return fmt::format("{}{}", topic_names::kHostPartition, host);
}

std::string status_partition(std::string_view host) {
  return fmt::format("{}{}", topic_names::kStatusPartition, host);
}

std::string client_partition(std::string_view guid_hex, std::string_view host) {
  return fmt::format("{}{}/{}", topic_names::kClientPartition, guid_hex, host);
}

std::string block_partition(std::string_view to_host, std::string_view from_host) {
  return fmt::format("{}{}/{}", topic_names::kBlocksPartition, to_host, from_host);
}

Result<Entity> make_topic(dds_entity_t participant, const TopicInfo& topic) {
  return check_entity(dds_create_topic(participant, topic.type, topic.name, nullptr, nullptr),
                      fmt::format("cannot create topic {}", topic.name));
}

Result<Entity> make_writer(dds_entity_t parent, dds_entity_t topic, const Qos& qos) {
  return check_entity(dds_create_writer(parent, topic, qos.get(), nullptr), "cannot create a writer");
}

Result<Entity> make_reader(dds_entity_t parent, dds_entity_t topic, const Qos& qos) {
  return check_entity(dds_create_reader(parent, topic, qos.get(), nullptr), "cannot create a reader");
}

Result<Entity> make_publisher(dds_entity_t participant, const std::string& partition) {
  Qos qos;
  qos.partition(partition);
  return check_entity(dds_create_publisher(participant, qos.get(), nullptr),
                      "cannot create publisher " + partition);
}

Result<Entity> make_subscriber(dds_entity_t participant, const std::string& partition) {
  Qos qos;
  qos.partition(partition);
  return check_entity(dds_create_subscriber(participant, qos.get(), nullptr),
                      "cannot create subscriber " + partition);
}

Result<TopicReader> open_reader(dds_entity_t participant, dds_entity_t subscriber, const TopicInfo& topic,
                                const Qos& qos) {
  PLCHOST_TRY_ASSIGN(auto made, make_topic(participant, topic));
  PLCHOST_TRY_ASSIGN(auto reader, make_reader(subscriber, made.get(), qos));
  return TopicReader{.topic = std::move(made), .reader = std::move(reader)};
}

Result<TopicWriter> open_writer(dds_entity_t participant, dds_entity_t publisher, const TopicInfo& topic) {
  PLCHOST_TRY_ASSIGN(auto made, make_topic(participant, topic));
  PLCHOST_TRY_ASSIGN(auto writer, make_writer(publisher, made.get(), qos_of(topic)));
  return TopicWriter{.topic = std::move(made), .writer = std::move(writer)};
}

Result<PartitionWriter> open_writer(dds_entity_t participant, const std::string& partition,
                                    dds_entity_t topic, const Qos& qos) {
  PLCHOST_TRY_ASSIGN(auto publisher, make_publisher(participant, partition));
  PLCHOST_TRY_ASSIGN(auto writer, make_writer(publisher.get(), topic, qos));
  return PartitionWriter{.publisher = std::move(publisher), .writer = std::move(writer)};
}

}  // namespace plchost::dds
