#include "api/dds/topics.hpp"

#include <fmt/format.h>

#include "api/dds/error.hpp"

namespace plchost::dds {

Qos request_qos() {
  Qos qos;
  qos.reliable(kRequestBlocking).keep_all();
  return qos;
}

Qos event_qos() {
  Qos qos;
  qos.reliable(kEventBlocking).keep_all();
  return qos;
}

Qos reply_qos() {
  Qos qos;
  qos.reliable(kServerBlocking).keep_last(kReplyDepth).transient_local();
  return qos;
}

Qos page_qos() {
  Qos qos;
  qos.reliable(kServerBlocking).keep_last(kPageDepth).transient_local();
  return qos;
}

Qos ack_qos() {
  Qos qos;
  qos.reliable(kServerBlocking).keep_last(1).transient_local();
  return qos;
}

Qos run_qos() {
  Qos qos;
  qos.reliable(kServerBlocking).keep_last(kRunDepth).transient_local();
  return qos;
}

Qos status_qos() {
  Qos qos;
  qos.reliable(kServerBlocking).keep_last(1).transient_local().no_autodispose();
  return qos;
}

Qos presence_qos() {
  Qos qos = status_qos();
  qos.deadline(kPresenceDeadline);
  return qos;
}

// Never waits: how much may be under way is the business of BlockWindow.
Qos block_qos() {
  Qos qos;
  qos.reliable(Duration::zero()).keep_all();
  return qos;
}

Qos transition_qos() {
  Qos qos;
  qos.reliable(kServerBlocking).keep_last(kTransitionDepth).transient_local().no_autodispose();
  return qos;
}

std::string name_partition(std::string_view host) {
  return fmt::format("n.{}", host);
}

std::string host_partition(std::string_view host) {
  return fmt::format("h.{}", host);
}

std::string status_partition(std::string_view host) {
  return fmt::format("s.{}", host);
}

std::string client_partition(std::string_view guid_hex, std::string_view host) {
  return fmt::format("c.{}/{}", guid_hex, host);
}

std::string block_partition(std::string_view to_host, std::string_view from_host) {
  return fmt::format("b.{}/{}", to_host, from_host);
}

Result<Entity> make_topic(dds_entity_t participant, const TopicInfo& topic) {
  return check_entity(dds_create_topic(participant, topic.type, topic.name, nullptr, nullptr),
                      fmt::format("make topic {}", topic.name));
}

Result<Entity> make_writer(dds_entity_t parent, dds_entity_t topic, const Qos& qos) {
  return check_entity(dds_create_writer(parent, topic, qos.get(), nullptr), "make a writer");
}

Result<Entity> make_reader(dds_entity_t parent, dds_entity_t topic, const Qos& qos) {
  return check_entity(dds_create_reader(parent, topic, qos.get(), nullptr), "make a reader");
}

Result<Entity> make_publisher(dds_entity_t participant, const std::string& partition) {
  Qos qos;
  qos.partition(partition);
  return check_entity(dds_create_publisher(participant, qos.get(), nullptr), "make publisher " + partition);
}

Result<Entity> make_subscriber(dds_entity_t participant, const std::string& partition) {
  Qos qos;
  qos.partition(partition);
  return check_entity(dds_create_subscriber(participant, qos.get(), nullptr), "make subscriber " + partition);
}

}  // namespace plchost::dds
