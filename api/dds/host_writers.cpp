#include "api/dds/host_writers.hpp"

#include <cstdint>
#include <set>
#include <string_view>

#include "api/dds/entity.hpp"
#include "api/dds/topics.hpp"

namespace plchost::dds {

namespace {

// One that is in several partitions speaks for nobody.
std::string host_of(const dds_qos_t* qos) {
  std::uint32_t count = 0;
  char** names = nullptr;
  if (qos == nullptr || !dds_qget_partition(qos, &count, &names)) return "";
  std::string host;
  if (count == 1) host = host_in_partition(names[0]);
  for (std::uint32_t i = 0; i < count; ++i) dds_free(names[i]);
  dds_free(static_cast<void*>(names));
  return host;
}

}  // namespace

std::string_view host_in_partition(std::string_view partition) noexcept {
  if (const auto slash = partition.rfind('/'); slash != std::string_view::npos) {
    return partition.substr(slash + 1);
  }
  const auto dot = partition.find('.');
  return dot == std::string_view::npos ? std::string_view() : partition.substr(dot + 1);
}

std::vector<std::string> discovered_hosts(dds_entity_t participant) {
  const Entity writers(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr));
  std::set<std::string> hosts;
  take_valid<dds_builtintopic_endpoint_t>(
      writers.get(), [&](const dds_builtintopic_endpoint_t& writer, const auto& /*info*/) {
        if (std::string_view(writer.topic_name) == kPresence.name) hosts.insert(host_of(writer.qos));
      });
  hosts.erase("");
  return {hosts.begin(), hosts.end()};
}

const std::string* HostWriters::find(dds_entity_t reader, dds_instance_handle_t writer) {
  auto known = hosts_.find(writer);
  if (known == hosts_.end()) {
    dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader, writer);
    if (endpoint == nullptr) return nullptr;
    if (hosts_.size() >= kMost) hosts_.clear();
    known = hosts_.emplace(writer, host_of(endpoint->qos)).first;
    dds_builtintopic_free_endpoint(endpoint);
  }
  return &known->second;
}

bool HostWriters::speaks_for(std::string_view host, dds_entity_t reader, const dds_sample_info_t& info) {
  const std::string* const behind = find(reader, info.publication_handle);
  return behind != nullptr && !host.empty() && *behind == host;
}

std::string HostWriters::host_behind(dds_entity_t reader, dds_instance_handle_t writer) {
  const std::string* const behind = find(reader, writer);
  return behind == nullptr ? "" : *behind;
}

}  // namespace plchost::dds
