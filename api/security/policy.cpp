#include "api/security/policy.hpp"

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <topic_names.hpp>

#include "api/security/xml_text.hpp"

namespace plchost::security {

namespace {

using Topics = std::vector<std::string_view>;
using topic_names::kBlockHostStatus;
using topic_names::kBlocksPartition;
using topic_names::kClientPartition;
using topic_names::kEngineerTopics;
using topic_names::kHostPartition;
using topic_names::kNamePartition;
using topic_names::kOperatorRequest;
using topic_names::kRequests;
using topic_names::kStatusPartition;
using topic_names::kViewerRequest;

/// Some topics in some partitions; no partition: the default one.
struct Grant {
  Topics topics;
  std::string partition = {};
};

constexpr std::string_view kDocument =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
    "xsi:noNamespaceSchemaLocation=\"https://www.omg.org/spec/DDS-SECURITY/20170901/{}.xsd\">\n{}</dds>\n";

constexpr std::string_view kDomains = "<domains><id_range><min>0</min><max>230</max></id_range></domains>";

template <std::size_t N>
Topics topics_of(const std::array<std::string_view, N>& topics) {
  return Topics(topics.begin(), topics.end());
}

std::string in(std::string_view partition, std::string_view rest) {
  return std::string(partition).append(rest);
}

// Those for a host, and more of these.
Topics asking(const Topics& more) {
  Topics topics = topics_of(topic_names::kHost);
  topics.insert(topics.end(), more.begin(), more.end());
  return topics;
}

// The names come from the contract. Which requests a role may write stays written out, so the requests of a
// new role are no right of viewers, operators and engineers. A host writes into partitions that name it: no
// reader takes its samples in the name of another.
std::vector<Grant> may_write(const Subject& subject) {
  const std::string& name = subject.name;
  switch (subject.role) {
    case Role::viewer:
      return {{{kViewerRequest}, in(kHostPartition, "*")}};
    case Role::operating:
      return {{asking({kViewerRequest, kOperatorRequest}), in(kHostPartition, "*")}};
    case Role::engineer:
      return {{asking({kViewerRequest, kOperatorRequest, kEngineerTopics}), in(kHostPartition, "*")}};
    case Role::admin:
      return {{asking({kRequests, kEngineerTopics}), in(kHostPartition, "*")}};
    case Role::host:
      return {{topics_of(topic_names::kStatus), in(kStatusPartition, name)},
              {topics_of(topic_names::kClient), in(kClientPartition, "*/" + name)},
              {topics_of(topic_names::kBlocks), in(kBlocksPartition, "*/" + name)},
              {topics_of(topic_names::kName), in(kNamePartition, name)}};
  }
  return {};
}

std::vector<Grant> may_read(const Subject& subject, const GuidPrefix& prefix) {
  const std::string& name = subject.name;
  if (subject.role == Role::host) {
    return {{{kBlockHostStatus}, in(kStatusPartition, "*")},
            {asking({kRequests, kEngineerTopics}), in(kHostPartition, name)},
            {topics_of(topic_names::kBlocks), in(kBlocksPartition, name + "/*")},
            {topics_of(topic_names::kName), in(kNamePartition, name)}};
  }
  return {
      {topics_of(topic_names::kStatus), in(kStatusPartition, "*")},
      {topics_of(topic_names::kClient), in(kClientPartition, fmt::format("{:02x}*", fmt::join(prefix, "")))}};
}

std::string criteria(std::string_view what, const std::vector<Grant>& grants) {
  std::string text;
  for (const Grant& grant : grants) {
    text += fmt::format("<{}><topics>", what);
    for (const std::string_view topic : grant.topics) text += fmt::format("<topic>{}</topic>", topic);
    text += "</topics>";
    if (!grant.partition.empty()) {
      text += fmt::format("<partitions><partition>{}</partition></partitions>", grant.partition);
    }
    text += fmt::format("</{}>\n", what);
  }
  return text;
}

std::string time_text(std::time_t time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}", fmt::gmtime(time));
}

}  // namespace

std::string governance_text() {
  const std::string rule = fmt::format(
      "<domain_access_rules><domain_rule>{}\n"
      "<allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
      "<enable_join_access_control>true</enable_join_access_control>\n"
      "<discovery_protection_kind>ENCRYPT</discovery_protection_kind>\n"
      "<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>\n"
      "<rtps_protection_kind>SIGN</rtps_protection_kind>\n"
      "<topic_access_rules><topic_rule><topic_expression>*</topic_expression>\n"
      "<enable_discovery_protection>true</enable_discovery_protection>\n"
      "<enable_liveliness_protection>true</enable_liveliness_protection>\n"
      "<enable_read_access_control>true</enable_read_access_control>\n"
      "<enable_write_access_control>true</enable_write_access_control>\n"
      "<metadata_protection_kind>ENCRYPT</metadata_protection_kind>\n"
      "<data_protection_kind>NONE</data_protection_kind>\n"
      "</topic_rule></topic_access_rules></domain_rule></domain_access_rules>\n",
      kDomains);
  return fmt::format(kDocument, "omg_shared_ca_governance", rule);
}

std::string permissions_text(const Subject& subject, const std::string& subject_text,
                             const GuidPrefix& prefix, const Validity& validity) {
  const std::string grant = fmt::format(
      "<permissions><grant name=\"{}\"><subject_name>{}</subject_name>\n"
      "<validity><not_before>{}</not_before><not_after>{}</not_after></validity>\n"
      "<allow_rule>{}\n{}{}</allow_rule>\n<default>DENY</default></grant></permissions>\n",
      subject.name, escaped(subject_text), time_text(validity.not_before), time_text(validity.not_after),
      kDomains, criteria("publish", may_write(subject)), criteria("subscribe", may_read(subject, prefix)));
  return fmt::format(kDocument, "omg_shared_ca_permissions", grant);
}

}  // namespace plchost::security
