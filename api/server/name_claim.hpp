#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include <control.h>

#include "api/dds/guid.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The claimant of a host's name.
struct NameHolder {
  dds::Guid server;  ///< the participant of its plchost-dds
  std::uint64_t epoch = 0;
  std::int64_t since_ns = 0;  ///< from when on it has had the name
  bool serving = false;       ///< false: it asks
  std::string place;          ///< the same for all servers of one host
  std::string machine;        ///< for people
};

/// Whether `own` must leave the name to `other`. Of two hosts that claim one name exactly one must.
[[nodiscard]] bool yields(const NameHolder& own, const NameHolder& other) noexcept;

/// The name of this host in the DDS domain: two hosts that have one name see each other, and one of them
/// ends. Control loop only.
class NameClaim {
 public:
  struct Options {
    std::string host;
    std::string run_directory;
    std::uint64_t epoch = 0;
    std::int64_t since_ns = 0;
    bool serving = false;
  };
  /// So long a host that comes asks before it serves: a host nearby has answered by then.
  static constexpr Duration kAsking = std::chrono::milliseconds(300);
  /// One that was refused the name takes its time: also a host behind a slow link, or with DDS Security, has
  /// answered by then.
  static constexpr Duration kAskingAgain = std::chrono::seconds(2);
  /// So much longer it asks if a claim is known to come.
  static constexpr Duration kLateClaim = std::chrono::seconds(5);
  /// So long a host that leaves the name waits for the acknowledgement of the one that has it.
  static constexpr Duration kBeingHeard = std::chrono::seconds(5);
  /// So long a rival is told of after it was seen.
  static constexpr Duration kRivalShown = std::chrono::seconds(90);

  [[nodiscard]] static Result<NameClaim> create(dds_entity_t participant, const Options& options);

  /// Waits until the deadline whether somebody else has the name, then serves. If DDS knows of another claim
  /// that has not come yet, it waits for that, kLateClaim longer at most. already_exists: somebody has.
  /// unavailable: there is something to be read from `stop_fd`, before the deadline.
  [[nodiscard]] Result<void> ask(TimePoint deadline, int stop_fd);

  enum class State : std::uint8_t {
    ours,
    taken,  ///< another host has it: this one must end
    left,   ///< another host has served under it and has gone: all status must be told anew
  };
  /// Reads what has come; to be called when something has, and from time to time.
  [[nodiscard]] State look(TimePoint now);

  /// After State::taken: waits until the host that has the name knows of this one, kBeingHeard at most and
  /// not if there is something to be read from `stop_fd`. Returns that host, and what to do.
  [[nodiscard]] Error leave(int stop_fd);
  /// Another host that wants the name, or wanted it a short time ago; empty: none.
  [[nodiscard]] const std::string& rival() const noexcept { return rival_; }
  /// To be listened to.
  [[nodiscard]] dds_entity_t reader() const noexcept { return claims_.reader.get(); }

 private:
  NameClaim() = default;
  [[nodiscard]] Result<void> write();
  /// True: that was the end of another host that has served under the name.
  bool take(const plc_NameClaim& sample, const dds_sample_info_t& info, TimePoint now);
  void meet(const NameHolder& other, TimePoint now);
  void be_heard(int stop_fd);
  [[nodiscard]] bool has_heard_all() const;
  [[nodiscard]] bool is_read_by(const dds::Guid& server) const;

  std::string host_;
  NameHolder own_;
  NameHolder winner_;
  std::map<dds::Guid, NameHolder> others_;
  std::set<dds_instance_handle_t> heard_;  ///< the writers of the claims that came while it asked
  std::set<dds::Guid> told_;
  std::string rival_;
  TimePoint rival_seen_;
  dds::Entity subscriber_;
  dds::TopicReader claims_;
  dds::PartitionWriter own_claim_;
};

}  // namespace plchost
