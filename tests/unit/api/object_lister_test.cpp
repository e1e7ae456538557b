#include "api/server/lists/object_lister.hpp"

#include <algorithm>
#include <atomic>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <pwd.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "api/cli/rows/object_rows.hpp"
#include "api/server/lists/account_names.hpp"
#include "shm/base/names.hpp"
#include "shm/process/thread_owner.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ObjectListerTest : public testing::Test {
 protected:
  ~ObjectListerTest() override {
    events_.clear();
    ObjectPool::remove(name_);
  }

  void make_events(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      events_.push_back(pool_.create_shared_event(fmt::format("line{}/e{:04}", i % 2, i)).value().object);
    }
  }
  // A new lister: it has no objects of a moment ago.
  [[nodiscard]] std::vector<std::string> all(ObjectQuery query, std::size_t& pages,
                                             TimePoint until = kNoDeadline) {
    ObjectLister sut(pool_);
    std::vector<std::string> names;
    for (pages = 1;; ++pages) {
      auto listing = sut.page(query, until).value();
      EXPECT_LE(listing.objects.size(), kPageObjects);
      for (const ListedObject& listed : listing.objects) names.emplace_back(listed.name());
      if (listing.complete) return names;
      EXPECT_GT(listing.next_after, query.after);
      if (listing.next_after <= query.after) return names;
      query.after = listing.next_after;
    }
  }
  [[nodiscard]] std::vector<std::string> all(const ObjectQuery& query) {
    std::size_t pages = 0;
    return all(query, pages);
  }

  std::string name_ = own_name("lister");
  ObjectPool pool_ = ObjectPool::create(name_, {.max_objects = 4096}).value();
  std::vector<SharedEvent> events_;
};

TEST_F(ObjectListerTest, ListsEachObjectOnceInTheOrderOfNamesOverAllPages) {
  make_events(1000);
  std::size_t pages = 0;
  const auto names = all({}, pages);
  EXPECT_EQ(pages, 4U);
  EXPECT_EQ(names.size(), 1000U);
  EXPECT_EQ(std::set(names.begin(), names.end()).size(), 1000U);
  EXPECT_TRUE(std::ranges::is_sorted(names));
}

TEST_F(ObjectListerTest, GoesOnWhereItHadNoMoreTime) {
  make_events(300);
  std::size_t pages = 0;
  EXPECT_THAT(all({.match = "*e0299"}, pages, TimePoint{}), ElementsAre("line1/e0299"));
  EXPECT_GT(pages, 3U) << "64 names at a time";
}

TEST_F(ObjectListerTest, AnswersWithAFewInOnePage) {
  make_events(1000);
  const auto memory = pool_.create_memory("line1/image", 4096).value();
  std::size_t pages = 0;
  EXPECT_THAT(all({.type = ObjectType::memory}, pages), ElementsAre("line1/image"));
  EXPECT_EQ(pages, 1U);
  EXPECT_THAT(all({.type = ObjectType::event, .match = "line1/e000?"}, pages),
              ElementsAre("line1/e0001", "line1/e0003", "line1/e0005", "line1/e0007", "line1/e0009"));
  EXPECT_EQ(pages, 1U);
  EXPECT_TRUE(all({.match = "line7/*"}).empty());
  EXPECT_TRUE(all({.after = "zzz"}).empty());
}

TEST_F(ObjectListerTest, EndsAPageAtItsReferences) {
  std::vector<ObjectPool> users;
  for (int i = 0; i < 40; ++i) users.push_back(ObjectPool::attach(name_).value());
  make_events(80);
  for (int k = 0; k < 40; ++k) {
    for (const ObjectPool& user : users) {
      events_.push_back(user.open_shared_event(fmt::format("line{}/e{:04}", k % 2, k)).value());
    }
  }
  ObjectLister sut(pool_);
  const auto listing = sut.page({}, kNoDeadline).value();
  std::size_t references = 0;
  for (const ListedObject& listed : listing.objects) references += listed.references.size();
  EXPECT_FALSE(listing.complete);
  EXPECT_LE(references, kPageReferences);
  std::size_t pages = 0;
  EXPECT_EQ(all({}, pages).size(), 80U);
  EXPECT_EQ(pages, 2U);
}

TEST_F(ObjectListerTest, NamesTheOneThatMayHaveBeenMeant) {
  make_events(4);
  ObjectLister sut(pool_);
  EXPECT_EQ(sut.page({.name = "line1/e0001"}).value().objects.size(), 1U);
  const auto wrong = sut.page({.name = "line1/e001"});
  EXPECT_EQ(wrong.error().code, ErrorCode::not_found);
  EXPECT_THAT(wrong.error().message, HasSubstr("did you mean 'line1/e0001'?"));
}

TEST_F(ObjectListerTest, TellsWhoHoldsAMutex) {
  const auto mutex = pool_.create_mutex("line1/recipe").value();
  ObjectLister sut(pool_);
  EXPECT_EQ(sut.page({.name = "line1/recipe"}).value().objects.at(0).record.holder_pid, 0);
  ASSERT_EQ(mutex.object.lock(), plchost::ObjectStatus::done);
  const auto held = sut.page({.name = "line1/recipe"}).value().objects.at(0);
  EXPECT_EQ(held.record.holder_pid, ::getpid());
  EXPECT_EQ(held.record.value, static_cast<std::uint64_t>(::syscall(SYS_gettid)));
  EXPECT_THAT(state_text(held),
              HasSubstr(fmt::format("held by unit_api({}), thread {}", ::getpid(), held.record.value)));
  ASSERT_EQ(mutex.object.unlock(), plchost::ObjectStatus::done);
}

TEST(ThreadOwner, IsNothingForAThreadThatIsNotThere) {
  EXPECT_EQ(owner_of_thread(static_cast<std::uint32_t>(::getpid()))->program, "unit_api");
  EXPECT_FALSE(owner_of_thread(0));
  EXPECT_FALSE(owner_of_thread(0x7fffffff));
}

TEST_F(ObjectListerTest, ASampleCarriesAllThatIsKnown) {
  const auto memory = pool_.create_memory("line1/F\u00fclldruck", 4096, {.keep = true, .mode = 0640}).value();
  ObjectLister sut(pool_);
  const auto sent = sut.page({.name = "line1/F\u00fclldruck"}).value();
  ObjectPageSample sample(sent);
  const auto got = listing_of(sample.page());
  ASSERT_EQ(got.objects.size(), 1U);
  EXPECT_TRUE(got.complete);
  EXPECT_EQ(to_row("hosta", got.objects[0]), to_row("hosta", sent.objects[0]));
  const Row row = to_row("hosta", got.objects[0]);
  EXPECT_EQ(row["object"], "line1/F\u00fclldruck");
  EXPECT_EQ(row["type"], "memory");
  EXPECT_EQ(row["size_bytes"], 4096);
  EXPECT_EQ(row["mode"], "0640");
  EXPECT_EQ(row["owner"], ::geteuid());
  if (const passwd* const user = ::getpwuid(::geteuid()); user != nullptr) {
    EXPECT_EQ(row["owner_name"], user->pw_name);
  }
  if (const group* const of_file = ::getgrgid(::getegid()); of_file != nullptr) {
    EXPECT_EQ(row["group_name"], of_file->gr_name);
  }
  EXPECT_EQ(row["kept"], true);
  EXPECT_TRUE(row["value"].is_null());
  EXPECT_TRUE(row["registered"].is_null());
  ASSERT_EQ(row["references"].size(), 1U);
  EXPECT_EQ(row["references"][0]["program"], "unit_api");
  EXPECT_EQ(row["references"][0]["writable"], true);
  EXPECT_TRUE(pool_.remove_object("line1/F\u00fclldruck")) << "a kept one would outlive the test";
}

TEST(ObjectRows, ShowUsersWithoutANameAsNumbers) {
  ListedObject object;
  object.record.owner = 4'000'000'000;
  EXPECT_EQ(to_row("hosta", object)["owner"], 4'000'000'000);
  EXPECT_TRUE(to_row("hosta", object)["owner_name"].is_null());
  EXPECT_EQ(user_name(4'000'000'000), "");
}

TEST(ObjectPageSample, NamesEachUserThatCanBeShown) {
  ObjectListing sent;
  const std::vector<std::string> names{"eve", std::string(63, 'x'), std::string(64, 'x'), "a\x1b[2J", ""};
  for (const std::string& name : names) {
    sent.objects.push_back(
        listed_of({.name = "object", .references = {}}, {.owner_name = name, .group_name = "seven"}));
  }
  ObjectPageSample sample(sent);
  std::vector<std::string> got;
  for (const ListedObject& object : listing_of(sample.page()).objects) {
    EXPECT_STREQ(object.record.group_name, "seven");
    got.emplace_back(object.record.owner_name);
  }
  EXPECT_THAT(got, testing::ElementsAre("eve", names[1], "", "", "")) << "the others are shown as numbers";
}

TEST(ObjectRows, CutTheListOfHolders) {
  ObjectInfo info;
  info.reference_count = 70;
  for (std::uint32_t i = 0; i < kMostReferencesTold; ++i)
    info.references.push_back({.pid = i + 1, .program = "p"});
  const auto text = [&] { return holders_text(listed_of(info, {}), 2); };
  EXPECT_EQ(text(), "p(1), p(2) and 68 more");
  info.references.resize(1);
  info.reference_count = 1;
  EXPECT_EQ(text(), "p(1)");
  info.references.clear();
  info.reference_count = 0;
  EXPECT_EQ(text(), "");
}

TEST(ObjectRows, ShowATypeOfANewerHostAsItsNumber) {
  ListedObject object;
  object.record.type = 9;
  object.record.value = 5;
  EXPECT_EQ(to_row("hosta", object)["type"], "9");
  EXPECT_EQ(state_text(object), "value 5");
}

}  // namespace
}  // namespace plchost
