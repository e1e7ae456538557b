#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <type_traits>

#include <dds/dds.h>

#include "api/dds/host_writers.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The server that writes a status topic.
struct StatusSource {
  std::string host;
  std::uint64_t epoch = 0;
};

/// The present samples of one status topic, and those that have still to be written. Samples are compared as
/// bytes, so each begins as blank(). Their ext is empty, or on loan from memory that outlives them here.
template <class Sample>
  requires std::is_trivially_copyable_v<Sample>
class StatusTable {
 public:
  StatusTable() = default;
  StatusTable(StatusSource source, dds::TopicWriter way) noexcept
      : source_(std::move(source)), way_(std::move(way)) {}

  /// A sample of this host and server, to be filled.
  [[nodiscard]] Sample blank() const noexcept {
    Sample sample{};
    dds::copy_text(sample.host, source_.host);
    sample.epoch = source_.epoch;
    return sample;
  }

  /// Returns true if that is news.
  bool update(const std::string& key, const Sample& sample) {
    auto [it, added] = entries_.try_emplace(key);
    Entry& entry = it->second;
    entry.marked = true;
    // Samples begin as zeros, so the bytes between their members are equal, too.
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    if (!added && std::memcmp(&entry.sample, &sample, sizeof sample) == 0) return false;
    std::memcpy(&entry.sample, &sample, sizeof sample);
    entry.unwritten = true;
    return true;
  }

  /// A round: begin_round(), update() for all that is there, then dispose_rest() of what is not.
  void begin_round() {
    for (auto& [key, entry] : entries_) entry.marked = false;
  }
  bool dispose_rest() {
    bool any = false;
    for (auto it = entries_.begin(); it != entries_.end();) {
      any |= !it->second.marked;
      it = it->second.marked ? std::next(it) : dispose(it);
    }
    return any;
  }
  /// Disposes all whose key starts with `prefix`.
  bool dispose_under(const std::string& prefix) {
    bool any = false;
    for (auto it = entries_.lower_bound(prefix); it != entries_.end() && it->first.starts_with(prefix);) {
      it = dispose(it);
      any = true;
    }
    return any;
  }

  /// Writes what is not written, at most `budget` samples. A sample that a writer refuses stays for the next
  /// time.
  void write(std::size_t budget = SIZE_MAX) {
    for (auto& [key, entry] : entries_) {
      if (!entry.unwritten) continue;
      if (budget-- == 0) return;
      if (dds_write(way_.writer.get(), &entry.sample) != DDS_RETCODE_OK) return;
      entry.unwritten = false;
    }
  }

  [[nodiscard]] bool contains(const std::string& key) const { return entries_.contains(key); }
  [[nodiscard]] std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(entries_.size()); }

 private:
  struct Entry {
    Sample sample{};
    bool unwritten = true;
    bool marked = true;
  };
  using Entries = std::map<std::string, Entry>;

  typename Entries::iterator dispose(typename Entries::iterator it) {
    dds::end_row(way_.writer.get(), it->second.sample);
    return entries_.erase(it);
  }

  StatusSource source_;
  dds::TopicWriter way_;
  Entries entries_;
};

}  // namespace plchost
