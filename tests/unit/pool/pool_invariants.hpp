#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "shm/pool/pool_table.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

/// The fault in the lists of a pool that nobody uses at present; empty: none.
inline std::string damage_of(const PoolView& view) {
  const PoolHeader& header = view.header();
  if (header.noted != 0 || header.unsettled != 0 || header.rebuilding != 0 || (header.changes & 1) != 0) {
    return "something is unfinished";
  }
  std::vector<int> seen(view.entries().size());
  for (Link& bucket : view.buckets()) {
    const Link* link = &bucket;
    for (ObjectEntry* entry = view.entry(*link); entry != nullptr; entry = view.entry(*link)) {
      if (++seen[view.link_to(*entry) - 1] > 1) return "a chain joins another one";
      if (!PoolTable::is_valid(*entry)) return "an entry in a chain is not valid";
      if (PoolTable::peek(view, entry->name.view()) != entry) return "two objects have the same name";
      link = &entry->next;
    }
    if (*link != 0) return "a chain leads nowhere";
  }
  const Link* link = &header.first_free;
  for (ObjectEntry* entry = view.entry(*link); entry != nullptr; entry = view.entry(*link)) {
    if (++seen[view.link_to(*entry) - 1] > 1) return "the free list runs into another one";
    if (entry->state != 0) return "an entry of the free list is in use";
    link = &entry->next;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] != (i < header.high_water ? 1 : 0)) return fmt::format("entry {} is in no list", i);
  }

  std::vector<int> free_references(view.references().size());
  link = &header.first_free_reference;
  for (ReferenceEntry* one = view.reference(*link); one != nullptr; one = view.reference(*link)) {
    if (++free_references[view.link_to(*one) - 1] > 1) return "the free references run in a circle";
    if (one->object != 0) return "a free reference is in use";
    link = &one->next_free;
  }
  std::vector<std::uint32_t> of_object(view.entries().size());
  std::vector<std::uint32_t> of_client(view.clients().size());
  for (std::size_t i = 0; i < view.references().size(); ++i) {
    const ReferenceEntry& one = view.references()[i];
    if (one.object == 0) {
      if (i < header.reference_high_water && free_references[i] != 1) return "a reference is in no list";
      continue;
    }
    const ObjectEntry* const object = view.entry(one.object);
    const ClientSlot* const client = view.client(one.client);
    if (object == nullptr || !PoolTable::is_valid(*object)) return "a reference is on no object";
    if (one.object_generation != Binding::generation(object->binding)) return "a reference is on an old one";
    if (client == nullptr || client->pid == 0) return "a reference is of no client";
    if (one.client_generation != client->generation) return "a reference is of an old client";
    ++of_object[one.object - 1];
    ++of_client[one.client - 1];
  }
  for (std::size_t i = 0; i < of_object.size(); ++i) {
    const ObjectEntry& entry = view.entries()[i];
    if (entry.state == 0) continue;
    if (entry.reference_count != of_object[i])
      return fmt::format("the references of object '{}' are damaged", entry.name.view());
  }
  for (std::size_t i = 0; i < of_client.size(); ++i) {
    const ClientSlot& client = view.clients()[i];
    if (client.pid == 0) continue;
    if (client.reference_count != of_client[i])
      return fmt::format("the references of client {} are damaged", client.pid.load());
  }
  return "";
}

}  // namespace plchost
