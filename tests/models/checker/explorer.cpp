#include "tests/models/checker/explorer.hpp"

#include <bit>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <utility>

namespace plchost::models {

namespace {

constexpr std::size_t kStackSize = 128UL * 1024;
constexpr std::uint64_t kMaxStates = 60'000'000;

std::string text_of(std::uint64_t value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), value < 1000 ? "%llu" : "0x%llx",
                static_cast<unsigned long long>(value));
  return text.data();
}

}  // namespace

Explorer*& explorer() noexcept {
  static Explorer* current = nullptr;
  return current;
}

Explorer::Explorer(void (*set_up)(Scene&)) : set_up_(set_up), memory_(*this) {
  for (Thread& thread : threads_) thread.stack.resize(kStackSize);
  ::getcontext(&prototype_);
}

unsigned Explorer::choose(unsigned count) {
  if (count < 2) return 0;
  if (decided_ == decisions_.size()) decisions_.push_back({.chosen = by_chance(count), .of = count});
  return decisions_[decided_++].chosen;
}

// The first one in a search in depth.
unsigned Explorer::by_chance(unsigned count) noexcept {
  if (!walking_) return 0;
  chance_ = mix(chance_, count);
  return static_cast<unsigned>((chance_ >> 16U) % count);
}

// The next list of decisions in the order of a search in depth.
bool Explorer::next() {
  while (!decisions_.empty() && decisions_.back().chosen + 1 == decisions_.back().of) decisions_.pop_back();
  if (decisions_.empty()) return false;
  ++decisions_.back().chosen;
  return true;
}

Report Explorer::explore(std::uint64_t most) {
  explorer() = this;
  Report report;
  do {
    ++report.executions;
    run_once();
    report.cut += cut_ ? 1 : 0;
    report.longest = std::max(report.longest, static_cast<unsigned>(decisions_.size()));
    if (fault_.empty() && states_.size() > kMaxStates) fault_ = "more states than the checker can hold";
  } while (fault_.empty() && report.executions < most && next());
  report.states = states_.size();
  if (fault_.empty() && report.executions < most && expected_ != 0 && expected_ != observed_)
    report.fault = "the outcomes are " + text_of(observed_) + ", not " + text_of(expected_);
  tell_fault(report);
  explorer() = nullptr;
  return report;
}

Report Explorer::walk(std::uint64_t executions) {
  explorer() = this;
  walking_ = true;
  Report report;
  while (fault_.empty() && report.executions < executions) {
    ++report.executions;
    decisions_.clear();
    run_once();
    report.longest = std::max(report.longest, static_cast<unsigned>(decisions_.size()));
  }
  tell_fault(report);
  explorer() = nullptr;
  return report;
}

void Explorer::tell_fault(Report& report) {
  if (fault_.empty()) return;
  report.fault = fault_;
  tracing_ = true;
  run_once();
  report.trace = trace_;
}

ThreadNumber Explorer::thread(const char* name, std::function<void()> body, ThreadOptions options) {
  if (count_ == kMaxThreads) throw std::logic_error("too many threads");
  Thread& thread = threads_[count_];
  thread.name = name;
  thread.body = std::move(body);
  thread.options = options;
  thread.state = options.after < 0 ? State::ready : State::waiting;
  thread.history = 0;
  thread.begun = false;
  thread.next_at = kAnywhere;
  if (options.core >= 0) memory_.run_on(count_, static_cast<unsigned>(options.core));
  return count_++;
}

void Explorer::name(const void* object, std::size_t size, const char* name) {
  const Arena::Use off(false);
  names_.push_back({.begin = reinterpret_cast<std::uintptr_t>(object), .size = size, .text = name});
}

void Explorer::run_once() {
  decided_ = 0;
  for (Thread& thread : threads_) thread.body = {};  // lies in the arena
  check_ = {};
  when_killed_ = {};
  last_killed_ = -1;
  memory_.reset();
  Arena::reset();
  names_.clear();
  trace_.clear();
  fault_.clear();
  limits_ = {};
  count_ = 0;
  last_ = 0;
  asleep_ = 0;
  any_killed_ = false;
  cut_ = false;
  {
    const Arena::Use on(true);
    set_up_(*this);
  }
  left_ = limits_;
  for (unsigned i = 0; i < kMaxThreads; ++i) {
    if (i >= count_ || threads_[i].state == State::waiting) memory_.end(i);
  }
  for (unsigned i = 0; i < count_ && fault_.empty(); ++i) {
    if (threads_[i].state == State::ready && !threads_[i].begun) resume(i);
  }
  while (fault_.empty() && !cut_) {
    bool alive = false;
    for (unsigned i = 0; i < count_; ++i)
      alive = alive || threads_[i].state == State::ready || threads_[i].state == State::asleep;
    if (!alive) {
      const Arena::Use on(true);
      if (check_) check_();
      return;
    }
    collect();
    if (actions_.empty() || actions_.front().kind == Action::Kind::kill ||
        actions_.front().kind == Action::Kind::wake) {
      return fail("asleep for ever: nobody wakes the sleeper");
    }
    Action action{};
    if (!decide(action)) return;
    perform(action);
  }
}

// The possible next steps. The most promising come first: the thread that ran last before the others.
void Explorer::collect() {
  using Kind = Action::Kind;
  actions_.clear();
  for (unsigned i = 0; i < count_; ++i) {
    const unsigned at = (last_ + i) % count_;
    if (threads_[at].state == State::ready) actions_.push_back({.kind = Kind::run, .thread = at});
  }
  const bool stuck = actions_.empty();
  const bool may_time_out = stuck ? limits_.deadlines_rescue || any_killed_ : left_.early_timeouts > 0;
  for (unsigned i = 0; i < count_; ++i) {
    if (may_time_out && threads_[i].state == State::asleep && threads_[i].has_deadline)
      actions_.push_back({.kind = Kind::time_out, .thread = i});
  }
  for (unsigned i = 0; i < count_; ++i) {
    if (left_.spurious_wakes > 0 && threads_[i].state == State::asleep)
      actions_.push_back({.kind = Kind::wake, .thread = i});
  }
  for (unsigned i = 0; i < count_; ++i) {
    const bool alive = threads_[i].state == State::ready || threads_[i].state == State::asleep;
    if (left_.kills > 0 && alive && threads_[i].options.may_be_killed)
      actions_.push_back({.kind = Kind::kill, .thread = i});
  }
}

std::uint64_t Explorer::state() const {
  std::uint64_t hash = mix(memory_.hash(), Arena::hash());
  for (unsigned i = 0; i < count_; ++i) {
    const Thread& thread = threads_[i];
    hash = mix(hash, static_cast<std::uint64_t>(thread.state));
    if (thread.state == State::ready || thread.state == State::asleep) hash = mix(hash, thread.history);
    if (thread.state == State::asleep) hash = mix(hash, thread.word + (thread.has_deadline ? 1 : 0));
    if (thread.timed_out) hash = mix(hash, i);
  }
  hash = mix(hash, left_.kills);
  return mix(hash, left_.spurious_wakes << 8U | left_.weak_failures << 4U | left_.early_timeouts);
}

// A thread that does not share the core may see in which order two steps were done there.
bool Explorer::core_is_seen(int core) const {
  bool is_seen = false;
  for (unsigned i = 0; i < count_; ++i) is_seen = is_seen || threads_[i].options.core != core;
  return core >= 0 && is_seen;
}

bool Explorer::depend(unsigned a, unsigned b) const {
  const Thread& one = threads_[a];
  const Thread& other = threads_[b];
  if (core_is_seen(one.options.core) && one.options.core == other.options.core) return true;
  if (one.next_at == kAnywhere || other.next_at == kAnywhere) return true;
  return one.next_at == other.next_at && (one.next_writes || other.next_writes);
}

// Bits of the actions that are to be explored from here. If another execution was in this state, only those
// are that it had left to others.
std::uint32_t Explorer::worth_running() {
  bool fresh = false;
  StateMap::Entry& entry = states_.find(state(), fresh);
  std::uint32_t worth = 0;
  for (unsigned i = 0; i < actions_.size(); ++i) {
    const unsigned bit = 1U << actions_[i].thread;
    const bool runs = actions_[i].kind == Action::Kind::run;
    const bool left_out = runs && (asleep_ & bit) != 0;
    const bool explored = !fresh && (!runs || (entry.asleep & bit) == 0);
    if (!left_out && !explored) worth |= 1U << i;
  }
  entry.asleep = fresh ? asleep_ : static_cast<std::uint8_t>(entry.asleep & asleep_);
  return worth;
}

// False: nothing is left to explore from here.
bool Explorer::decide(Action& action) {
  std::uint32_t worth = 1;
  unsigned chosen = 0;
  if (actions_.size() == 1) {
    if (actions_[0].kind == Action::Kind::run && (asleep_ & 1U << actions_[0].thread) != 0 && !tracing_)
      return false;
  } else {
    if (decided_ == decisions_.size()) {
      worth = walking_ ? (1U << actions_.size()) - 1 : worth_running();
      if (worth == 0) return false;
      const auto of = static_cast<unsigned>(std::popcount(worth));
      decisions_.push_back({.chosen = by_chance(of), .of = of, .actions = worth});
    }
    worth = decisions_[decided_].actions;
    chosen = decisions_[decided_++].chosen;
  }
  std::uint8_t before = asleep_;
  std::uint32_t bits = worth;
  for (; chosen > 0; --chosen, bits &= bits - 1) {
    const Action& explored = actions_[static_cast<std::size_t>(std::countr_zero(bits))];
    if (explored.kind == Action::Kind::run)
      before = static_cast<std::uint8_t>(before | 1U << explored.thread);
  }
  action = actions_[static_cast<std::size_t>(std::countr_zero(bits))];
  asleep_ = 0;
  for (unsigned i = 0; i < count_ && !walking_; ++i) {
    if (action.kind == Action::Kind::run && i != action.thread && (before & 1U << i) != 0 &&
        !depend(i, action.thread))
      asleep_ = static_cast<std::uint8_t>(asleep_ | 1U << i);
  }
  return true;
}

void Explorer::perform(const Action& action) {
  Thread& thread = threads_[action.thread];
  const auto note = [&](const char* what) {
    if (tracing_) trace_.push_back(std::string(thread.name) + ": " + what);
  };
  switch (action.kind) {
    case Action::Kind::run:
      last_ = action.thread;
      return resume(action.thread);
    case Action::Kind::time_out:
      note("its deadline passes");
      if (actions_.front().kind == Action::Kind::run)
        --left_.early_timeouts;
      else
        memory_.catch_up(action.thread);  // nothing else could run, so much time has passed
      thread.timed_out = true;
      thread.state = State::ready;
      return;
    case Action::Kind::wake:
      note("wakes for no reason");
      --left_.spurious_wakes;
      thread.state = State::ready;
      return;
    case Action::Kind::kill:
      note("is killed");
      --left_.kills;
      return end_of(action.thread, State::killed);
  }
}

void Explorer::end_of(unsigned number, State how) {
  threads_[number].state = how;
  any_killed_ = any_killed_ || how == State::killed;
  memory_.end(number, how == State::killed && when_killed_ != nullptr);
  if (how == State::killed) {
    last_killed_ = static_cast<int>(number);
    if (when_killed_) when_killed_(number);
  }
  for (unsigned i = 0; i < count_ && fault_.empty(); ++i) {
    if (threads_[i].state != State::waiting || threads_[i].options.after != static_cast<int>(number))
      continue;
    threads_[i].state = State::ready;
    memory_.begin_after(i, number);
    resume(i);
  }
}

void Explorer::resume(unsigned number) {
  running_ = static_cast<int>(number);
  if (_setjmp(scheduler_) == 0) {
    Thread& thread = threads_[number];
    if (thread.begun) _longjmp(thread.at, 1);
    thread.begun = true;
    thread.context = prototype_;
    thread.context.uc_stack.ss_sp = thread.stack.data();
    thread.context.uc_stack.ss_size = thread.stack.size();
    thread.context.uc_link = nullptr;
    ::makecontext(&thread.context, &Explorer::fiber_entry, 0);
    ::setcontext(&thread.context);
  }
  const auto ran = static_cast<unsigned>(running_);
  running_ = -1;
  if (threads_[ran].state == State::ended || threads_[ran].state == State::killed)
    end_of(ran, threads_[ran].state);
}

void Explorer::fiber_entry() {
  Explorer& self = *explorer();
  {
    const Arena::Use on(true);
    self.threads_[self.self()].body();
  }
  self.threads_[self.self()].state = State::ended;
  self.leave();
}

void Explorer::leave() {
  _longjmp(scheduler_, 1);
}

void Explorer::back_to_scheduler() {
  if (_setjmp(threads_[self()].at) == 0) leave();
}

void Explorer::fail(std::string what) {
  if (fault_.empty()) fault_ = std::move(what);
  if (running_ >= 0) leave();
}

void Explorer::step(std::uintptr_t address, bool writes) {
  threads_[self()].next_at = address;
  threads_[self()].next_writes = writes;
  if (memory_.steps(self()) > limits_.steps) {
    // A search ends a thread that goes round in circles where its states come again; chance does not.
    cut_ = limits_.cut || walking_;
    if (cut_) leave();
    fail(std::string(threads_[self()].name) + " does not come to its end");
  }
  back_to_scheduler();
}

bool Explorer::weak_fails() {
  if (left_.weak_failures == 0 || choose(2) == 0) return false;
  --left_.weak_failures;
  return true;
}

void Explorer::done(const char* what, std::uintptr_t address, std::uint64_t argument, std::uint64_t result) {
  Thread& thread = threads_[self()];
  thread.history = mix(mix(thread.history, address), result);
  if (!tracing_) return;
  trace_.push_back(std::string(thread.name) + ": " + what + " " + place(address) + " (" + text_of(argument) +
                   ") = " + text_of(result));
}

Explorer::Sleep Explorer::sleep(std::uintptr_t word, bool has_deadline) {
  Thread& thread = threads_[self()];
  thread.state = State::asleep;
  thread.word = word;
  thread.has_deadline = has_deadline;
  thread.next_at = kAnywhere;  // it announces its next step when it is awake
  back_to_scheduler();
  return std::exchange(thread.timed_out, false) ? Sleep::timed_out : Sleep::woken;
}

unsigned Explorer::wake(std::uintptr_t word, unsigned count) {
  unsigned woken = 0;
  for (; woken < count; ++woken) {
    std::array<unsigned, kMaxThreads> sleepers{};
    unsigned found = 0;
    for (unsigned i = 0; i < count_; ++i) {
      if (threads_[i].state == State::asleep && threads_[i].word == word) sleepers[found++] = i;
    }
    if (found == 0) break;
    threads_[sleepers[count >= found ? 0 : choose(found)]].state = State::ready;
  }
  return woken;
}

void Explorer::plain_read(std::uintptr_t address, std::size_t size) {
  if (!memory_.plain_read(self(), address, size)) fail("a data race: a read of " + place(address));
}

void Explorer::plain_write(std::uintptr_t address, std::size_t size) {
  Thread& thread = threads_[self()];
  if (left_.kills > 0 && thread.options.may_be_killed && choose(2) == 1) {
    if (tracing_)
      trace_.push_back(std::string(thread.name) + ": is killed before it writes " + place(address));
    --left_.kills;
    thread.state = State::killed;
    leave();
  }
  if (!memory_.plain_write(self(), address, size)) fail("a data race: a write of " + place(address));
}

std::string Explorer::place(std::uintptr_t address) const {
  for (const Name& name : names_) {
    if (address - name.begin < name.size) return std::string(name.text) + "+" + text_of(address - name.begin);
  }
  return "memory " + text_of(address % (1UL << 20U));
}

}  // namespace plchost::models
