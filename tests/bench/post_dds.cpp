// An external event posted over DDS by another process, through plchost-dds and the pool, to the first
// instruction of the task's code in a real instance. The floor is a bare Cyclone DDS one-way, same type, same
// QoS, from the same poster on the same core. It ends in a waiting thread of the same priority on the same
// core as the task.

#include <thread>

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "api/dds/domain.hpp"
#include "api/dds/error.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/system_call.hpp"
#include "tests/bench/cell.hpp"
#include "tests/bench/dds_poster.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/shared_board.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kPostDdsSlice = std::chrono::seconds(1);

/// The floor: a thread that waits for samples.
class BareReader {
 public:
  Result<void> start(const Plan& plan, const DdsDomains& domains, DdsBoard& board) {
    dds::DomainOptions options;
    options.domain = domains.bare;
    PLCHOST_TRY_ASSIGN(domain_, dds::open_domain(dds::Role::server, options));
    auto participant =
        dds::check_entity(dds_create_participant(domains.bare, nullptr, nullptr), "make a participant");
    if (!participant) return std::unexpected(participant.error());
    participant_ = std::move(*participant);
    PLCHOST_TRY_ASSIGN(auto topic, dds::make_topic(participant_.get(), dds::kEventPost));
    dds::Qos qos = dds::qos_of(dds::kEventPost);
    qos.max_samples(dds::kEventPost.qos.reader_holds);
    PLCHOST_TRY_ASSIGN(auto reader, dds::make_reader(participant_.get(), topic.get(), qos));
    topic_ = std::move(topic);
    reader_ = std::move(reader);
    waitset_ = dds::Entity(dds_create_waitset(participant_.get()));
    dds_set_status_mask(reader_.get(), DDS_DATA_AVAILABLE_STATUS);
    dds_waitset_attach(waitset_.get(), reader_.get(), 0);
    dds_waitset_attach(waitset_.get(), waitset_.get(), 1);
    PLCHOST_TRY_ASSIGN(thread_, Thread::start("bare-reader", kPriority, [this, &plan, &board] {
                         if (bind_thread({plan.task_core})) run(board);
                       }));
    return {};
  }
  void stop() {
    dds_waitset_set_trigger(waitset_.get(), true);
    thread_.join();
  }

 private:
  void run(DdsBoard& board) {
    dds_attach_t reasons[2] = {};
    while (true) {
      const dds_return_t woken = dds_waitset_wait(waitset_.get(), reasons, 2, DDS_INFINITY);
      for (dds_return_t i = 0; i < woken; ++i) {
        if (reasons[i] == 1) return;
      }
      const dds::Samples<plc_EventPost> samples(reader_.get());
      for (std::size_t i = 0; i < samples.size(); ++i) {
        if (samples.valid(i)) board.record(MonotonicClock::now().time_since_epoch().count());
      }
    }
  }

  std::shared_ptr<dds::Entity> domain_;
  dds::Entity participant_;
  dds::Entity topic_;
  dds::Entity reader_;
  dds::Entity waitset_;
  Thread thread_;
};

/// Lets the poster do one slice, and takes its figures.
Result<void> run_slice(DdsBoard& board, Order order, std::uint32_t posts, Samples& into) {
  board.arrived.store(0);
  board.posts.store(posts);
  board.order.store(static_cast<std::uint32_t>(order));
  auto done =
      wait_until([&] { return board.order.load() == static_cast<std::uint32_t>(Order::wait); }, "a slice");
  if (!done) return done;
  for (std::uint32_t i = 0; i < board.arrived.load(std::memory_order_acquire); ++i) {
    into.push(Duration(board.latency_ns[i]));
  }
  return {};
}

Result<std::vector<Row>> measure(const Plan& plan, const DdsDomains& domains, DdsBoard& board,
                                 const std::string& name) {
  // The bare reader's DDS threads inherit this core: the one where plchost-dds has its own.
  const OnCore threads_inherit_it(plan.poster_core);
  Cell cell(plan, domains, name);
  PLCHOST_TRY(cell.start(plan));
  BareReader reader;
  PLCHOST_TRY(reader.start(plan, domains, board));
  std::vector<Row> rows(1);
  rows[0].name = "post/dds";
  rows[0].sample = "a post";
  auto done = wait_until([&] { return board.poster_ready.load() != 0; }, "the poster's start");
  if (done && board.poster_ready.load() != 1)
    done = failure(ErrorCode::unavailable, "the poster cannot post");
  const auto posts_in = [&](Duration slice) { return static_cast<std::uint32_t>(slice / plan.post_gap); };
  if (done) {
    done = alternate(
        plan,
        {[&](Duration slice) { return run_slice(board, Order::post_bare, posts_in(slice), rows[0].floor); },
         [&](Duration slice) { return run_slice(board, Order::post_event, posts_in(slice), rows[0].ours); }},
        kPostDdsSlice);
  }
  reader.stop();
  if (!done) return std::unexpected(done.error());
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_post_dds(const Plan& plan) {
  constexpr std::uint32_t kFirstDomain = 110;
  const auto salt = static_cast<std::uint32_t>(::getpid()) % 40U;
  const DdsDomains domains{.plchost = kFirstDomain + 2 * salt, .bare = kFirstDomain + 2 * salt + 1};
  const std::string name = own_name("bench");
  const std::string board_name = name + ".board";
  PLCHOST_TRY_ASSIGN(auto memory, MemoryFile::replace(board_name, sizeof(DdsBoard)));
  ::setenv(kBoardVariable, ("/dev/shm/" + board_name).c_str(), 1);
  auto& board = *reinterpret_cast<DdsBoard*>(memory.bytes().data());
  // Forked before this process has any thread of DDS.
  const pid_t poster = ::fork();
  if (poster == 0) ::_exit(run_dds_poster(plan, domains, board));
  auto rows = measure(plan, domains, board, name);
  board.order.store(static_cast<std::uint32_t>(Order::end));
  if (poster > 0) ::waitpid(poster, nullptr, 0);
  MemoryFile::remove(board_name);
  return rows;
}

}  // namespace plchost::bench
