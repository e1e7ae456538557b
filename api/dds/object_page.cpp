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
static_assert(dds::bounds::ObjectRecord::references == kMostReferencesTold);

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

}  // namespace

ListedObject listed_of(const ObjectInfo& info, const ObjectUsers& users) {
  ListedObject listed{.record = {}, .references = samples_of(info.references)};
  plc_ObjectRecord& record = listed.record;
  dds::copy_text(record.object_name, info.name);
  record.type = static_cast<std::uint32_t>(info.type);
  record.value = info.value;
  record.holder_pid = static_cast<std::int32_t>(users.holder_pid);
  copy_program(record.holder_program, users.holder_program);
  record.size = info.size;
  record.registered = info.registered;
  record.bound_tasks = info.bound_tasks;
  record.waiters = info.waiters;
  record.kept = info.kept;
  record.owner = info.owner;
  copy_account(record.owner_name, users.owner_name);
  record.group = info.group;
  copy_account(record.group_name, users.group_name);
  record.mode = info.mode;
  record.made_unix_ns = info.made_unix_ns;
  record.reference_count = info.reference_count;
  return listed;
}

ObjectPageSample::ObjectPageSample(const ObjectListing& listing) {
  const std::size_t count = std::min(listing.objects.size(), kPageObjects);
  for (std::size_t i = 0; i < count; ++i) {
    auto& references = references_.emplace_back(listing.objects[i].references);
    dds::lend(records_.emplace_back(listing.objects[i].record).references, references);
  }
  page_.complete = listing.complete;
  dds::copy_text(page_.next_after, listing.next_after);
  dds::lend(page_.objects, records_);
}

ObjectListing listing_of(const plc_ObjectPage& page) {
  ObjectListing listing{
      .objects = {}, .complete = page.complete, .next_after = std::string(dds::text_of(page.next_after))};
  for (const plc_ObjectRecord& record : dds::parts_of(page.objects)) {
    const auto references = dds::parts_of(record.references);
    ListedObject& listed = listing.objects.emplace_back();
    listed.record = record;
    listed.record.references = {};
    listed.references.assign(references.begin(), references.end());
  }
  return listing;
}

}  // namespace plchost
