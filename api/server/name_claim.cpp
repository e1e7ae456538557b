#include "api/server/name_claim.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <tuple>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "api/dds/error.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

/// Waits for that, so long at most.
bool is_asked_to_end(int stop_fd, int wait_ms) {
  pollfd stop{.fd = stop_fd, .events = POLLIN, .revents = 0};
  return ::poll(&stop, 1, wait_ms) > 0;
}

std::string machine_name() {
  std::array<char, 65> name{};
  (void)::gethostname(name.data(), name.size() - 1);
  return name.data();
}

// A run directory has one manager at a time, and what was before the last boot is no more: all servers of one
// place are one after the other. Containers share a boot, but no folder of one number.
std::string place_of(const std::string& run_directory) {
  std::string boot;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), boot);
  struct stat folder{};
  (void)::stat(run_directory.c_str(), &folder);
  return fmt::format("{} {}:{}", boot.empty() ? machine_name() : boot, folder.st_dev, folder.st_ino);
}

NameHolder holder_of(const plc_NameClaim& sample) {
  const auto machine = dds::text_of(sample.machine);
  return {.server = dds::Guid::from(sample.server),
          .epoch = sample.epoch,
          .since_ns = sample.since_unix_ns,
          .serving = sample.serving,
          .place = std::string(dds::text_of(sample.place)),
          .machine = is_printable_utf8(machine) ? std::string(machine) : "unknown"};
}

}  // namespace

bool yields(const NameHolder& own, const NameHolder& other) noexcept {
  if (own.place == other.place) return false;  // left-overs of a server that was replaced
  if (own.serving != other.serving) return other.serving;
  return std::tie(other.since_ns, other.place) < std::tie(own.since_ns, own.place);
}

Result<NameClaim> NameClaim::create(dds_entity_t participant, const Options& options) {
  NameClaim claim;
  claim.host_ = options.host;
  claim.own_ = {
      .server = dds::guid_of(participant),
      .epoch = options.epoch,
      .since_ns = options.since_ns,
      .serving = options.serving,
      .place = place_of(options.run_directory),
      .machine = fmt::format("{}, process {}, {}", machine_name(), ::getpid(), options.run_directory)};
  const std::string partition = dds::name_partition(options.host);
  const dds::Qos qos = dds::qos_of(dds::kNameClaim);
  PLCHOST_TRY_ASSIGN(auto subscriber,
                     in_step("cannot claim the host's name", dds::make_subscriber(participant, partition)));
  PLCHOST_TRY_ASSIGN(auto claims,
                     in_step("cannot claim the host's name",
                             dds::open_reader(participant, subscriber.get(), dds::kNameClaim, qos)));
  PLCHOST_TRY_ASSIGN(auto own_claim,
                     in_step("cannot claim the host's name",
                             dds::open_writer(participant, partition, claims.topic.get(), qos)));
  claim.subscriber_ = std::move(subscriber);
  claim.claims_ = std::move(claims);
  claim.own_claim_ = std::move(own_claim);
  PLCHOST_TRY(claim.write());
  return claim;
}

Result<void> NameClaim::write() {
  plc_NameClaim sample{};
  own_.server.copy_to(sample.server);
  dds::copy_text(sample.host, host_);
  sample.epoch = own_.epoch;
  sample.since_unix_ns = own_.since_ns;
  sample.serving = own_.serving;
  dds::copy_text(sample.place, own_.place);
  dds::copy_text(sample.machine, own_.machine);
  return dds::check_code(dds_write(own_claim_.writer.get(), &sample), "cannot claim the host's name");
}

Result<void> NameClaim::ask(TimePoint deadline, int stop_fd) {
  constexpr int kLookMs = 2;
  while (!own_.serving) {
    if (look(MonotonicClock::now()) == State::taken) return std::unexpected(leave(stop_fd));
    if (MonotonicClock::now() >= (has_heard_all() ? deadline : deadline + kLateClaim)) {
      own_.serving = true;
      heard_.clear();
      return write();
    }
    if (is_asked_to_end(stop_fd, kLookMs)) {
      return failure(ErrorCode::unavailable, "asked to end before it was known whether the name is free");
    }
  }
  return {};
}

bool NameClaim::has_heard_all() const {
  return std::ranges::all_of(dds::writers_of(claims_.reader.get()),
                             [this](dds_instance_handle_t writer) { return heard_.contains(writer); });
}

bool NameClaim::is_read_by(const dds::Guid& server) const {
  const dds_entity_t writer = own_claim_.writer.get();
  return std::ranges::any_of(dds::readers_of(writer), [&](dds_instance_handle_t reader) {
    dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_subscription_data(writer, reader);
    if (endpoint == nullptr) return false;
    const dds::Guid participant = dds::Guid::from(endpoint->key.v).participant();
    dds_builtintopic_free_endpoint(endpoint);
    return participant == server;
  });
}

// The claim of the other one may be here before its reader is known. DDS takes what was written before that
// for acknowledged, and sends it only as long as the writer is there: so the claim is written again for that
// reader.
void NameClaim::be_heard(int stop_fd) {
  constexpr int kLookMs = 2;
  const TimePoint end = MonotonicClock::now() + kBeingHeard;
  const auto goes_on = [&](int wait_ms) {
    return !is_asked_to_end(stop_fd, wait_ms) && MonotonicClock::now() < end;
  };
  while (!is_read_by(winner_.server)) {
    if (!goes_on(kLookMs)) return;
  }
  if (!write()) return;
  while (dds_wait_for_acks(own_claim_.writer.get(), DDS_MSECS(kLookMs)) == DDS_RETCODE_TIMEOUT &&
         goes_on(0)) {
  }
}

void NameClaim::meet(const NameHolder& other, TimePoint now) {
  rival_ = other.machine;
  rival_seen_ = now;
  if (told_.insert(other.server).second) {
    spdlog::warn("another host {} the name '{}': {}; it came later and has to end",
                 other.serving ? "serves under" : "asks for", host_, other.machine);
  }
  constexpr std::size_t kMostTold = 1024;
  if (told_.size() > kMostTold) told_.clear();
}

bool NameClaim::take(const plc_NameClaim& sample, const dds_sample_info_t& info, TimePoint now) {
  const dds::Guid server = dds::Guid::from(sample.server);
  if (server == own_.server) return false;
  const bool alive = info.instance_state == DDS_IST_ALIVE;
  if (info.valid_data) {
    NameHolder other = holder_of(sample);
    if (other.place == own_.place) return false;
    if (alive) {
      const dds::Guid writer = dds::writer_of(claims_.reader.get(), info);
      // It has ended since it wrote, so whose word this is cannot be known any more: it is a rival, and wins
      // nothing. Its end is not told again.
      if (writer == dds::Guid{}) {
        meet(other, now);
        return other.serving && own_.serving;
      }
      if (writer.participant() != server) return false;  // or in the name of another
    }
    if (!alive) meet(other, now);
    others_[server] = std::move(other);
  }
  if (alive) return false;
  const auto gone = others_.extract(server);
  return !gone.empty() && gone.mapped().serving && own_.serving;
}

NameClaim::State NameClaim::look(TimePoint now) {
  State state = State::ours;
  dds::take_all<plc_NameClaim>(claims_.reader.get(),
                               [&](const plc_NameClaim& sample, const dds_sample_info_t& info) {
                                 if (!own_.serving) heard_.insert(info.publication_handle);
                                 if (take(sample, info, now)) state = State::left;
                               });
  for (const auto& [server, other] : others_) {
    if (yields(own_, other)) {
      winner_ = other;
      return State::taken;
    }
    meet(other, now);
  }
  if (others_.empty() && now - rival_seen_ > kRivalShown) rival_.clear();
  return state;
}

Error NameClaim::leave(int stop_fd) {
  be_heard(stop_fd);
  constexpr std::int64_t kSecond = 1'000'000'000;
  return failure(
             ErrorCode::already_exists,
             fmt::format(
                 "another host of this DDS domain has the name '{}', since {:%Y-%m-%d %H:%M:%S} UTC: {}. "
                 "This one is not served, its PLCs run on: give one of the two another [host] name",
                 host_, fmt::gmtime(static_cast<std::time_t>(winner_.since_ns / kSecond)), winner_.machine))
      .error();
}

}  // namespace plchost
