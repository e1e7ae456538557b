#include "api/dds/object_page.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

static_assert(sizeof(plc_ObjectRecord::object_name) == kMaxObjectName + 1);

// A program is called by the first 15 bytes of its name, which may tear a character: no wrong text travels.
template <std::size_t N>
void copy_program(char (&to)[N], std::string_view name) {
  dds::copy_text(to, is_printable_utf8(name) ? cut(name, N - 1) : std::string_view("?"));
}

std::vector<plc_ObjectReference> samples_of(const std::vector<ReferenceInfo>& references) {
  std::vector<plc_ObjectReference> samples(std::min<std::size_t>(references.size(), kMostReferencesTold));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] = {.pid = static_cast<std::int32_t>(references[i].pid),
                  .program = {},
                  .writable = references[i].writable,
                  .waiting = references[i].waiting};
    copy_program(samples[i].program, references[i].program);
  }
  return samples;
}

// The name of a user or a group. One that cannot be shown is left out: its number says as much.
template <std::size_t Size>
void copy_account(char (&to)[Size], std::string_view name) noexcept {
  dds::copy_text(to, name.size() < Size && is_printable_utf8(name) ? name : std::string_view());
}

void fill(plc_ObjectRecord& record, const ListedObject& listed) {
  const ObjectInfo& info = listed.info;
  dds::copy_text(record.object_name, info.name);
  record.type = static_cast<std::uint32_t>(info.type);
  record.value = info.value;
  record.holder_pid = static_cast<std::int32_t>(listed.holder_pid);
  copy_program(record.holder_program, listed.holder_program);
  record.size = info.size;
  record.registered = info.registered;
  record.bound_tasks = info.bound_tasks;
  record.waiters = info.waiters;
  record.kept = info.kept;
  record.owner = info.owner;
  copy_account(record.owner_name, listed.owner_name);
  record.group = info.group;
  copy_account(record.group_name, listed.group_name);
  record.mode = info.mode;
  record.made_unix_ns = info.made_unix_ns;
  record.reference_count = info.reference_count;
}

ListedObject object_of(const plc_ObjectRecord& record) {
  ListedObject listed;
  listed.holder_pid = static_cast<std::uint32_t>(record.holder_pid);
  listed.holder_program = dds::text_of(record.holder_program);
  listed.owner_name = dds::text_of(record.owner_name);
  listed.group_name = dds::text_of(record.group_name);
  listed.info = {.name = std::string(dds::text_of(record.object_name)),
                 .type = static_cast<ObjectType>(record.type),
                 .value = record.value,
                 .size = record.size,
                 .registered = record.registered,
                 .bound_tasks = record.bound_tasks,
                 .waiters = record.waiters,
                 .kept = record.kept,
                 .owner = record.owner,
                 .group = record.group,
                 .mode = record.mode,
                 .made_unix_ns = record.made_unix_ns,
                 .references = {},
                 .reference_count = record.reference_count};
  for (const plc_ObjectReference& reference : dds::parts_of(record.references)) {
    listed.info.references.push_back({.pid = static_cast<std::uint32_t>(reference.pid),
                                      .program = std::string(dds::text_of(reference.program)),
                                      .writable = reference.writable,
                                      .waiting = reference.waiting});
  }
  return listed;
}

}  // namespace

ObjectPageSample::ObjectPageSample(const ObjectListing& listing) {
  records_.resize(std::min(listing.objects.size(), kPageObjects));
  for (std::size_t i = 0; i < records_.size(); ++i) {
    fill(records_[i], listing.objects[i]);
    auto& references = references_.emplace_back(samples_of(listing.objects[i].info.references));
    dds::lend(records_[i].references, references);
  }
  page_.complete = listing.complete;
  dds::copy_text(page_.next_after, listing.next_after);
  dds::lend(page_.objects, records_);
}

ObjectListing listing_of(const plc_ObjectPage& page) {
  ObjectListing listing{
      .objects = {}, .complete = page.complete, .next_after = std::string(dds::text_of(page.next_after))};
  for (const plc_ObjectRecord& record : dds::parts_of(page.objects)) {
    listing.objects.push_back(object_of(record));
  }
  return listing;
}

}  // namespace plchost
