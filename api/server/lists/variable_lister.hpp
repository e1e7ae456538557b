#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <control.h>

#include "api/dds/guid.hpp"
#include "api/dds/variable_page.hpp"
#include "api/server/lists/value_link.hpp"
#include "api/server/lists/variable_selection.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// Lists variables of instances for clients: names and types from the table that an instance shows, values
/// over its values socket. Never waits. Control loop only.
class VariableLister {
 public:
  /// How many lists may be under way: together, of one client, and of one instance, which may not answer.
  static constexpr std::size_t kMaxPending = 32;
  static constexpr std::size_t kMaxPendingOfClient = 8;
  static constexpr std::size_t kMaxPendingOfInstance = 16;
  /// An instance may take no longer for its answer, whatever its client says.
  static constexpr Duration kMostPatience = std::chrono::hours(1);

  /// A list that was asked for.
  struct Asker {
    dds::Guid client;  ///< participant
    plc_SampleIdentity identity{};
    std::string instance;
  };
  struct Finished {
    Asker asker;
    Result<VariableAnswer> listing;
  };

  [[nodiscard]] static Result<VariableLister> create(std::string pool, std::string run_directory);

  /// Readable when receive() has something to do.
  [[nodiscard]] int fd() const noexcept { return epoll_.get(); }
  /// Begins with it; the end is told by receive(), or by expire() at the deadline. busy: too many are under
  /// way. not_found: the instance declares no variables, or there is no such variable. unavailable: its
  /// process has ended.
  [[nodiscard]] Result<void> begin(Asker asker, VariableQuery query, TimePoint now, TimePoint deadline);
  [[nodiscard]] bool is_pending(const plc_SampleIdentity& identity) const;
  [[nodiscard]] std::vector<Finished> receive();
  /// Those that were not answered in time.
  [[nodiscard]] std::vector<Finished> expire(TimePoint now);

 private:
  struct Pending {
    Asker asker;
    VariableQuery query;
    TimePoint begin;
    TimePoint deadline;
    std::shared_ptr<const SymbolTable> table = {};
    VariableSelection selection = {};
    ValueKind asked = ValueKind::current;    // the reply that comes next
    std::optional<ValueReply> current = {};  // of the selection; nothing: they are asked for
    std::optional<ValueReply> forced = {};   // the same of those that are forced
    bool renewed = false;                    // the table has changed meanwhile
  };
  struct Peer {
    ValueLink link;
    std::shared_ptr<const SymbolTable> table;
    std::deque<ValueRequest> requests = {};  // the first one is under way
    /// Puts it behind the others.
    [[nodiscard]] Result<void> ask(ValueRequest request);
    /// The first one has its reply.
    [[nodiscard]] Result<void> ask_next();
    /// Nobody waits for its reply any more.
    void forget(std::uint64_t number);
  };

  VariableLister(std::string pool, std::string run_directory, UniqueFd epoll)
      : pool_(std::move(pool)), run_directory_(std::move(run_directory)), epoll_(std::move(epoll)) {}
  [[nodiscard]] Result<void> connect(const std::string& instance);
  /// Asks by the newest table. A connection to a process that has ended is made anew.
  [[nodiscard]] Result<void> ask_first(Pending& pending, std::uint64_t number);
  [[nodiscard]] Result<void> select(Pending& pending);
  [[nodiscard]] Result<void> ask(Pending& pending, std::uint64_t number, ValueKind kind);
  /// Goes on with a reply. Nothing: it is not done yet.
  [[nodiscard]] std::optional<Result<VariableAnswer>> take(Pending& pending, ValueReply reply);
  [[nodiscard]] Result<bool> go_on(Pending& pending, std::uint64_t number);
  [[nodiscard]] Result<void> renew(Pending& pending, std::uint64_t number);
  void take_from(const std::string& instance, std::vector<Finished>& finished);
  void drop(const std::string& instance, const Error& why, std::vector<Finished>& finished);

  std::string pool_;
  std::string run_directory_;
  UniqueFd epoll_;
  std::map<std::string, Peer> peers_;         // by instance
  std::map<std::uint64_t, Pending> pending_;  // by the number of their requests
  std::uint64_t next_number_ = 1;
};

}  // namespace plchost
