#include "schedulers/tick/due_queue.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace plchost {
namespace {

TEST(DueQueue, GivesTheEarliestFirstAndNothingBeforeItsTime) {
  DueQueue sut;
  std::array<DueQueue::Entry, 5> entry;
  constexpr std::array<Duration::rep, 5> kDue{50, 10, 40, 20, 30};
  sut.reserve(entry.size());
  for (std::size_t i = 0; i < entry.size(); ++i) sut.put(entry[i], kDue[i]);
  EXPECT_EQ(sut.take_due(9), nullptr);
  for (const std::size_t i : {1U, 3U, 4U, 2U}) EXPECT_EQ(sut.take_due(45), &entry[i]);
  EXPECT_EQ(sut.take_due(45), nullptr);
  EXPECT_EQ(sut.take_due(50), &entry[0]);
  EXPECT_EQ(sut.size(), 0U);
}

TEST(DueQueue, MovesAnEntryThatIsInIt) {
  DueQueue sut;
  std::array<DueQueue::Entry, 3> entry;
  sut.reserve(entry.size());
  for (auto& each : entry) sut.put(each, 10);
  sut.put(entry[1], 30);
  sut.put(entry[2], 5);
  EXPECT_EQ(sut.size(), 3U);
  EXPECT_EQ(sut.take_due(100), &entry[2]);
  EXPECT_EQ(sut.take_due(100), &entry[0]);
  EXPECT_EQ(sut.take_due(100), &entry[1]);
}

TEST(DueQueue, ForgetsWhatIsTakenOutAndTakesNoOffenceAtWhatIsNotIn) {
  DueQueue sut;
  DueQueue::Entry entry;
  sut.reserve(1);
  sut.remove(entry);
  sut.put(entry, 1);
  sut.remove(entry);
  EXPECT_EQ(sut.take_due(100), nullptr);
  sut.put(entry, 2);
  EXPECT_EQ(sut.take_due(100), &entry);
}

TEST(DueQueue, DoesWhatAPlainMapDoesInAnyOrderOfCalls) {
  constexpr std::size_t kEntries = 200;
  DueQueue sut;
  std::array<DueQueue::Entry, kEntries> entries;
  sut.reserve(kEntries);
  std::map<const DueQueue::Entry*, Duration::rep> model;
  std::mt19937 random(3);
  const auto pick = [&](int below) { return std::uniform_int_distribution(0, below - 1)(random); };
  for (int step = 0; step < 50'000; ++step) {
    DueQueue::Entry& entry = entries[static_cast<std::size_t>(pick(kEntries))];
    const int now = pick(1000);
    switch (pick(4)) {
      case 0:
      case 1:
        sut.put(entry, now);
        model[&entry] = now;
        break;
      case 2:
        sut.remove(entry);
        model.erase(&entry);
        break;
      default:
        const DueQueue::Entry* const taken = sut.take_due(now);
        const auto earliest =
            std::ranges::min_element(model, {}, [](const auto& each) { return each.second; });
        ASSERT_EQ(taken != nullptr, earliest != model.end() && earliest->second <= now);
        if (taken == nullptr) break;
        ASSERT_TRUE(model.contains(taken));
        ASSERT_EQ(model.at(taken), earliest->second);
        model.erase(taken);
    }
    ASSERT_EQ(sut.size(), model.size());
  }
}

}  // namespace
}  // namespace plchost
