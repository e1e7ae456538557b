#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// The parts of a pool's segment, as they lie for the number of objects that was validated at attach, and the
/// way from a link to its entry. Cheap to make and to copy.
class PoolView {
 public:
  /// `memory` holds at least pool_size(max_objects) bytes.
  PoolView(std::span<std::byte> memory, std::uint32_t max_objects) noexcept
      : header_(reinterpret_cast<PoolHeader*>(memory.data())),
        clients_(reinterpret_cast<ClientSlot*>(memory.data() + kClientsOffset), kMaxClients),
        references_(reinterpret_cast<ReferenceEntry*>(memory.data() + kReferencesOffset),
                    max_references_for(max_objects)),
        entries_(reinterpret_cast<ObjectEntry*>(memory.data() + entries_offset(max_objects)), max_objects),
        buckets_(reinterpret_cast<Link*>(memory.data() + buckets_offset(max_objects)),
                 bucket_count_for(max_objects)) {}

  [[nodiscard]] PoolHeader& header() const noexcept { return *header_; }
  [[nodiscard]] std::span<ClientSlot> clients() const noexcept { return clients_; }
  [[nodiscard]] std::span<ReferenceEntry> references() const noexcept { return references_; }
  [[nodiscard]] std::span<ObjectEntry> entries() const noexcept { return entries_; }
  [[nodiscard]] std::span<Link> buckets() const noexcept { return buckets_; }

  /// Those that were ever used.
  [[nodiscard]] std::span<ObjectEntry> used_entries() const noexcept {
    return used(entries_, header_->high_water);
  }
  [[nodiscard]] std::span<ReferenceEntry> used_references() const noexcept {
    return used(references_, header_->reference_high_water);
  }
  [[nodiscard]] std::span<ClientSlot> used_clients() const noexcept {
    return used(clients_, header_->client_high_water);
  }

  /// Null: the link leads nowhere.
  [[nodiscard]] ObjectEntry* entry(const Link& link) const noexcept { return at(entries_, link); }
  [[nodiscard]] ReferenceEntry* reference(const Link& link) const noexcept { return at(references_, link); }
  [[nodiscard]] ClientSlot* client(const Link& link) const noexcept { return at(clients_, link); }

  /// The object that a reference is on; null: the place is free, or the object is another one by now.
  [[nodiscard]] ObjectEntry* object_of(const ReferenceEntry& reference) const noexcept {
    ObjectEntry* const object = entry(reference.object);
    const bool same = object != nullptr && reference.object_generation.load(kRelaxed) ==
                                               Binding::generation(object->binding.load(kRelaxed));
    return same ? object : nullptr;
  }
  /// Whether it is on that object: for a search, which so reads the table of references alone.
  [[nodiscard]] bool is_on(const ReferenceEntry& reference, const ObjectEntry& object) const noexcept {
    return reference.object.load(kRelaxed) == link_to(object) && object_of(reference) == &object;
  }
  /// The client that holds a reference; null: the place is free, or its slot is another client's by now.
  [[nodiscard]] ClientSlot* client_of(const ReferenceEntry& reference) const noexcept {
    ClientSlot* const client =
        reference.object.load(kRelaxed) != 0 ? this->client(reference.client) : nullptr;
    const bool same =
        client != nullptr && reference.client_generation.load(kRelaxed) == client->generation.load(kRelaxed);
    return same ? client : nullptr;
  }

  [[nodiscard]] std::uint32_t link_to(const ObjectEntry& entry) const noexcept {
    return link_in(entries_, entry);
  }
  [[nodiscard]] std::uint32_t link_to(const ReferenceEntry& entry) const noexcept {
    return link_in(references_, entry);
  }
  [[nodiscard]] std::uint32_t link_to(const ClientSlot& slot) const noexcept {
    return link_in(clients_, slot);
  }

 private:
  template <class T>
  static std::span<T> used(std::span<T> all, const std::atomic<std::uint32_t>& count) noexcept {
    return all.first(std::min<std::size_t>(count.load(std::memory_order_relaxed), all.size()));
  }
  template <class T>
  static T* at(std::span<T> all, const Link& link) noexcept {
    const std::uint32_t value = link.load(std::memory_order_relaxed);
    return value >= 1 && value <= all.size() ? &all[value - 1] : nullptr;
  }
  template <class T>
  static std::uint32_t link_in(std::span<T> all, const T& one) noexcept {
    return static_cast<std::uint32_t>(&one - all.data()) + 1;
  }

  PoolHeader* header_;
  std::span<ClientSlot> clients_;
  std::span<ReferenceEntry> references_;
  std::span<ObjectEntry> entries_;
  std::span<Link> buckets_;
};

}  // namespace plchost
