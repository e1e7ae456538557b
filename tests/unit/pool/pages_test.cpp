#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "tests/support/interrupted_write.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class Pages : public testing::Test {
 protected:
  ~Pages() override {
    HostPageWriter::remove(pool());
    InstancePage::remove(pool(), "line1");
  }
  [[nodiscard]] const std::string& pool() const { return name_.get(); }
  static MemoryFile map(const std::string& name) {
    return std::move(MemoryFile::open(name, 1, MemoryFile::Access::read_write).value());
  }
  UniquePoolName name_;
};

std::vector<TaskIdentity> tasks_of(std::size_t count) {
  std::vector<TaskIdentity> tasks(count);
  for (std::size_t i = 0; i < count; ++i) tasks[i].name.assign("task" + std::to_string(i));
  return tasks;
}

TEST_F(Pages, HostPageOverWhichAStrangerHasWrittenIsWrittenAnew) {
  auto writer = HostPageWriter::create(pool());
  ASSERT_TRUE(writer);
  HostStatus host;
  host.name.assign("controller");
  host.instance_count = 1;
  writer->write_host(host);
  InstanceStatus instance;
  instance.name.assign("line1");
  writer->write_instance(0, instance);
  EXPECT_FALSE(writer->keep()) << "nothing has happened";
  const auto sut = HostPageReader::open(pool());
  const MemoryFile memory = map(host_page_name(pool()));
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  for (int round = 0; round < 200; ++round) {
    const std::size_t at = random() % 900;
    memory.bytes()[at] ^= static_cast<std::byte>(1 + random() % 255);
    writer->keep();
    ASSERT_EQ(sut->host().value_or(HostStatus{}).name.view(), "controller") << at;
    ASSERT_EQ(sut->instance(0).value_or(InstanceStatus{}).name.view(), "line1") << at;
    ASSERT_TRUE(HostPageReader::open(pool())) << at;
  }
}

TEST_F(Pages, HostPageThatWasCutShortIsMadeAnew) {
  MemoryGuard::watch_process();
  auto writer = HostPageWriter::create(pool());
  ASSERT_TRUE(writer);
  HostStatus host;
  host.name.assign("controller");
  writer->write_host(host);
  const auto before = HostPageReader::open(pool());
  std::filesystem::resize_file("/dev/shm/" + host_page_name(pool()), 0);
  EXPECT_EQ(before->host().value_or(HostStatus{}).name.view(), "");
  EXPECT_TRUE(before->lost());
  EXPECT_TRUE(writer->keep());
  const auto after = HostPageReader::open(pool());
  ASSERT_TRUE(after) << after.error().describe();
  EXPECT_EQ(after->host()->name.view(), "controller");
  EXPECT_FALSE(writer->keep());
}

TEST_F(Pages, HostPageTellsNoNameThatCouldDriveATerminal) {
  auto writer = HostPageWriter::create(pool());
  ASSERT_TRUE(writer);
  InstanceStatus instance;
  instance.name.assign("line1");
  instance.problem.assign("no file '/tmp/\x1b[2J\xff'");
  writer->write_instance(0, instance);
  const auto sut = HostPageReader::open(pool());
  ASSERT_TRUE(sut->instance(0)) << "a path may be of any bytes";
  EXPECT_EQ(sut->instance(0)->problem.view(), "no file '/tmp/?[2J?'");
  const MemoryFile memory = map(host_page_name(pool()));
  const auto found = std::ranges::search(memory.bytes(), std::as_bytes(std::span("line1", 5)));
  ASSERT_FALSE(found.empty());
  found.front() = std::byte{0x1b};
  EXPECT_FALSE(sut->instance(0)) << "written by a stranger";
}

TEST_F(Pages, HostPageCarriesWhatTheManagerWrites) {
  auto writer = HostPageWriter::create(pool());
  ASSERT_TRUE(writer) << writer.error().describe();
  const auto sut = HostPageReader::open(pool());
  ASSERT_TRUE(sut) << sut.error().describe();
  const auto before = sut->changes();
  HostStatus host;
  host.name.assign("controller");
  host.instance_count = kMaxInstances;
  writer->write_host(host);
  InstanceStatus instance;
  instance.name.assign("line1");
  instance.state = InstanceState::safe_mode;
  instance.core = 3;
  instance.plan.after.assign(std::string(kMaxAfter, 'a'));
  instance.plan.settings.assign("/etc/line\x1b[2J.cfg");
  writer->write_instance(kMaxInstances - 1, instance);
  EXPECT_EQ(sut->changes(), before + 2);
  EXPECT_EQ(sut->host()->name.view(), "controller");
  const auto read = sut->instance(kMaxInstances - 1);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->name.view(), "line1");
  EXPECT_EQ(read->state, InstanceState::safe_mode);
  EXPECT_EQ(read->core, 3);
  EXPECT_EQ(read->plan.after.view().size(), kMaxAfter);
  EXPECT_EQ(read->plan.settings.view(), "/etc/line?[2J.cfg");
  EXPECT_FALSE(sut->instance(kMaxInstances));
}

TEST_F(Pages, AFreshHostPageTellsNothing) {
  auto writer = HostPageWriter::create(pool());
  ASSERT_TRUE(writer);
  const auto sut = HostPageReader::open(pool());
  EXPECT_FALSE(sut->host()) << "not that there are no instances";
  EXPECT_FALSE(sut->instance(0));
  HostStatus host;
  host.instance_count = 1;
  writer->write_host(host);
  EXPECT_TRUE(sut->host());
  EXPECT_TRUE(sut->instance(0)) << "all places that are counted are written";
}

TEST_F(Pages, ReadersSeeTheNextManagerWithoutOpeningAnew) {
  {
    ASSERT_TRUE(HostPageWriter::create(pool()));
  }
  const auto sut = HostPageReader::open(pool());
  auto next = HostPageWriter::create(pool());
  ASSERT_TRUE(next);
  HostStatus host;
  host.manager_pid = 42;
  next->write_host(host);
  EXPECT_EQ(sut->host()->manager_pid, 42);
}

TEST_F(Pages, TheNextManagerTakesOverFromOneThatDiedWhileWriting) {
  {
    ASSERT_TRUE(HostPageWriter::create(pool()));
  }
  const MemoryFile memory = map(host_page_name(pool()));
  auto& page = *reinterpret_cast<HostPageLayout*>(memory.bytes().data());
  reinterpret_cast<std::atomic<std::uint64_t>*>(&page.host)->fetch_add(1);
  reinterpret_cast<std::atomic<std::uint64_t>*>(&page.instances[2])->fetch_add(1);
  const auto sut = HostPageReader::open(pool());
  EXPECT_FALSE(sut->host());
  auto next = HostPageWriter::create(pool());
  next->write_host({});
  next->write_instance(2, {});
  EXPECT_TRUE(sut->host());
  EXPECT_TRUE(sut->instance(2));
}

TEST_F(Pages, TheStateOfATaskIsReadAlsoWhileItsCountersAreWritten) {
  auto writer = InstancePage::create(pool(), "line1", tasks_of(1));
  ASSERT_TRUE(writer) << writer.error().describe();
  writer->set_task_state(0, PageTaskState::exception);
  interrupt_write(writer->task(0).counters);
  const auto sut = InstancePageReader::open(pool(), "line1");
  EXPECT_FALSE(sut->task(0));
  EXPECT_EQ(sut->task_state(0), PageTaskState::exception);
  EXPECT_EQ(sut->task_state(1), std::nullopt);
}

TEST_F(Pages, InstancePageCarriesTasksAndRuntime) {
  auto tasks = tasks_of(3);
  tasks[1].kind = TaskKind::external;
  tasks[1].external_event.assign("ready");
  auto writer = InstancePage::create(pool(), "line1", tasks);
  ASSERT_TRUE(writer) << writer.error().describe();
  EXPECT_EQ(writer->task_count(), 3U);
  InstanceRuntime runtime;
  runtime.pid = 7;
  writer->write_runtime(runtime);
  const auto sut = InstancePageReader::open(pool(), "line1");
  ASSERT_TRUE(sut) << sut.error().describe();
  const auto before = sut->task_sequence(1);
  TaskSlot& slot = writer->task(1);
  slot.state.store(static_cast<std::uint32_t>(PageTaskState::exception));
  TaskCounters counters{};
  counters.cycles = 11;
  slot.counters.write(counters);
  writer->statistics(1)[TaskHistogram::latency].record(Duration(20));
  EXPECT_NE(sut->task_sequence(1), before);
  EXPECT_EQ(sut->task_count(), 3U);
  EXPECT_EQ(sut->runtime()->pid, 7);
  const auto task = sut->task(1);
  ASSERT_TRUE(task);
  EXPECT_EQ(task->identity.name.view(), "task1");
  EXPECT_EQ(task->identity.external_event.view(), "ready");
  EXPECT_EQ(task->identity.kind, TaskKind::external);
  EXPECT_EQ(task->state, PageTaskState::exception);
  EXPECT_EQ(task->counters.cycles, 11U);
  EXPECT_EQ(sut->histogram(1, TaskHistogram::latency).percentile(0.99), Duration(20));
  EXPECT_FALSE(sut->task(3));
  EXPECT_EQ(sut->task_sequence(3), 0U);
}

TEST_F(Pages, InstancePageShowsATaskWithAFaultInException) {
  auto writer = InstancePage::create(pool(), "line1", tasks_of(2));
  ASSERT_TRUE(writer);
  const auto sut = InstancePageReader::open(pool(), "line1");
  ASSERT_TRUE(sut);
  EXPECT_FALSE(sut->fault(1));
  FaultRecord record;
  record.signal = 6;
  record.unix_ns = 1000;
  writer->task(1).fault.write(record);
  ASSERT_TRUE(sut->fault(1));
  EXPECT_EQ(sut->fault(1)->signal, 6);
  EXPECT_EQ(sut->fault(1)->unix_ns, 1000);
  EXPECT_EQ(sut->task(1)->state, PageTaskState::exception);
  EXPECT_FALSE(sut->fault(0));
  EXPECT_FALSE(sut->fault(2));
}

TEST_F(Pages, InstancePageOverWhichAStrangerHasWrittenIsWrittenAnew) {
  auto writer = InstancePage::create(pool(), "line1", tasks_of(3));
  ASSERT_TRUE(writer);
  FaultRecord record;
  record.kind = FaultKind::signal;
  record.signal = 11;
  const auto fault = [&](std::uint32_t task) {
    return task == 1 ? KnownFault{.raised = true, .record = &record} : KnownFault{};
  };
  for (std::uint32_t i = 0; i < 3; ++i) writer->set_task_state(i, PageTaskState::running);
  writer->set_task_state(1, PageTaskState::exception);
  writer->task(1).fault.write(record);
  InstanceRuntime runtime;
  runtime.pid = 7;
  TaskCounters counters{};
  counters.cycles = 5;
  EXPECT_FALSE(writer->keep(fault)) << "nothing has happened";
  const MemoryFile memory = map(instance_page_name(pool(), "line1"));
  const std::size_t most = sizeof(InstancePageLayout) + 3 * sizeof(TaskSlot);
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  for (int round = 0; round < 300; ++round) {
    const auto bytes = memory.bytes().first(most);
    if (round % 3 == 0) {
      std::ranges::generate(bytes, [&] { return static_cast<std::byte>(random()); });
      EXPECT_TRUE(writer->keep(fault));
    } else {
      bytes[random() % most] ^= static_cast<std::byte>(1 + random() % 255);
      (void)writer->keep(fault);
    }
    writer->write_runtime(runtime);
    for (std::uint32_t i = 0; i < 3; ++i) writer->statistics(i).counters.write(counters);
    EXPECT_FALSE(writer->keep(fault));
    const auto sut = InstancePageReader::open(pool(), "line1");
    ASSERT_TRUE(sut) << sut.error().describe();
    ASSERT_EQ(sut->runtime().value_or(InstanceRuntime{}).pid, 7);
    for (std::uint32_t i = 0; i < 3; ++i) {
      const auto task = sut->task(i);
      ASSERT_TRUE(task);
      ASSERT_EQ(task->identity.name.view(), "task" + std::to_string(i));
      ASSERT_EQ(task->state, i == 1 ? PageTaskState::exception : PageTaskState::running);
      ASSERT_EQ(task->counters.cycles, 5U);
    }
    ASSERT_FALSE(sut->fault(0));
    ASSERT_EQ(sut->fault(1).value_or(FaultRecord{}).signal, 11);
  }
}

TEST_F(Pages, InstancePageHoldsNoneAndTheMostTasksAndRefusesMore) {
  EXPECT_TRUE(InstancePage::create(pool(), "line1", {}));
  EXPECT_EQ(InstancePageReader::open(pool(), "line1")->task_count(), 0U);
  EXPECT_TRUE(InstancePage::create(pool(), "line1", tasks_of(kMaxTasks)));
  EXPECT_EQ(InstancePageReader::open(pool(), "line1")->task(kMaxTasks - 1)->identity.name.view(), "task1023");
  const auto more = InstancePage::create(pool(), "line1", tasks_of(kMaxTasks + 1));
  EXPECT_EQ(more.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(more.error().message, HasSubstr("at most 1024"));
}

TEST_F(Pages, HistogramsAreFineUpTo64TasksAndCoarseBeyond) {
  for (const auto& [count, digits] : {std::pair{kMaxFineTasks, HistogramShape::kFine},
                                      std::pair{kMaxFineTasks + 1, HistogramShape::kCoarse}}) {
    auto writer = InstancePage::create(pool(), "line1", tasks_of(count));
    const auto sut = InstancePageReader::open(pool(), "line1");
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_EQ(sut->histogram_shape().digits(), digits);
    for (std::uint32_t i = 0; i < count; ++i) {
      writer->statistics(i)[TaskHistogram::latency].record(Duration(i));
      writer->statistics(i)[TaskHistogram::jitter_positive].record(Duration::max());
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto total = [&](TaskHistogram which) { return sut->histogram(i, which).total(); };
      EXPECT_EQ(sut->histogram(i, TaskHistogram::latency).count(i), 1U);
      EXPECT_EQ(total(TaskHistogram::latency), 1U);
      EXPECT_EQ(total(TaskHistogram::execution), 0U);
      EXPECT_EQ(total(TaskHistogram::jitter_negative), 0U);
      EXPECT_EQ(total(TaskHistogram::jitter_positive), 1U);
    }
  }
}

TEST_F(Pages, HistogramsAreAsFineAsTheSettingsSay) {
  for (const auto& [fine_tasks, digits] :
       {std::pair{100U, HistogramShape::kFine}, std::pair{99U, HistogramShape::kCoarse}}) {
    const auto writer = InstancePage::create(pool(), "line1", tasks_of(100), fine_tasks);
    ASSERT_TRUE(writer);
    const auto sut = InstancePageReader::open(pool(), "line1");
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_EQ(sut->histogram_shape().digits(), digits);
  }
}

TEST_F(Pages, ReadersOfAnAbsentPageAreTold) {
  EXPECT_EQ(HostPageReader::open(pool()).error().code, ErrorCode::not_found);
  EXPECT_EQ(InstancePageReader::open(pool(), "line1").error().code, ErrorCode::not_found);
}

TEST_F(Pages, GarbageIsCorrupt) {
  std::mt19937 random(1);
  for (const std::size_t size : {std::size_t{1}, sizeof(InstancePageLayout), sizeof(HostPageLayout)}) {
    for (const auto& name : {host_page_name(pool()), instance_page_name(pool(), "line1")}) {
      const auto memory = MemoryFile::replace(name, size);
      ASSERT_TRUE(memory);
      std::ranges::generate(memory->bytes(), [&] { return static_cast<std::byte>(random()); });
    }
    EXPECT_EQ(HostPageReader::open(pool()).error().code, ErrorCode::corrupt);
    EXPECT_EQ(InstancePageReader::open(pool(), "line1").error().code, ErrorCode::corrupt);
  }
  EXPECT_TRUE(HostPageWriter::create(pool()));  // the manager makes it anew
  EXPECT_TRUE(HostPageReader::open(pool()));
}

TEST_F(Pages, HeadersThatDoNotFitAreCorrupt) {
  ASSERT_TRUE(InstancePage::create(pool(), "line1", tasks_of(2)));
  const MemoryFile memory = map(instance_page_name(pool(), "line1"));
  auto& page = *reinterpret_cast<InstancePageLayout*>(memory.bytes().data());
  const auto refused = [&] {
    const auto opened = InstancePageReader::open(pool(), "line1");
    return !opened && opened.error().code == ErrorCode::corrupt;
  };
  for (const std::uint32_t count : {0U, 1U, 3U, kMaxTasks + 1, ~0U}) {
    page.task_count = count;
    EXPECT_TRUE(refused());
  }
  page.task_count = 2;
  for (const std::uint32_t digits : {0U, 1U, HistogramShape::kCoarse, 4U, ~0U}) {
    page.digits = digits;
    EXPECT_TRUE(refused());
  }
  page.digits = HistogramShape::kFine;
  EXPECT_FALSE(refused());
  page.version += 1;
  EXPECT_TRUE(refused());
  page.version -= 1;
  page.size += 1;
  EXPECT_TRUE(refused());
  page.size -= 1;
  page.magic = 0;
  EXPECT_TRUE(refused());
}

TEST_F(Pages, AReaderKeepsToTheSizeThatItOpened) {
  auto writer = InstancePage::create(pool(), "line1", tasks_of(2));
  const auto sut = InstancePageReader::open(pool(), "line1");
  const MemoryFile memory = map(instance_page_name(pool(), "line1"));
  std::ranges::fill(memory.bytes(), std::byte{0xff});
  EXPECT_EQ(writer->task_count(), 2U);
  EXPECT_EQ(sut->task_count(), 2U);
  EXPECT_FALSE(sut->task(1));
  EXPECT_FALSE(sut->task(2));
  EXPECT_FALSE(sut->runtime());
  EXPECT_EQ(sut->histogram(1, TaskHistogram::jitter_positive).percentile(0.0), Duration::zero());
}

TEST_F(Pages, AnImpossibleInstanceCountIsNotShown) {
  auto writer = HostPageWriter::create(pool());
  const auto sut = HostPageReader::open(pool());
  HostStatus host;
  host.instance_count = kMaxInstances + 1;
  writer->write_host(host);
  EXPECT_FALSE(sut->host());
}

TEST_F(Pages, AFreshInstancePageTakesThePlaceOfTheOld) {
  ASSERT_TRUE(InstancePage::create(pool(), "line1", tasks_of(2)));
  const auto old = InstancePageReader::open(pool(), "line1");
  ASSERT_TRUE(InstancePage::create(pool(), "line1", tasks_of(5)));
  EXPECT_EQ(old->task_count(), 2U);
  EXPECT_TRUE(old->task(1));
  EXPECT_EQ(InstancePageReader::open(pool(), "line1")->task_count(), 5U);
  InstancePage::remove(pool(), "line1");
  EXPECT_EQ(InstancePageReader::open(pool(), "line1").error().code, ErrorCode::not_found);
}

TEST(PageEnums, AStateWithoutANameIsUnknown) {
  EXPECT_EQ(to_string(static_cast<InstanceState>(99)), "unknown");
}

}  // namespace
}  // namespace plchost
