#include <algorithm>
#include <filesystem>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "api/client/client_core_status.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/own_name.hpp"
#include "tests/support/whole_lines.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

class Objects : public testing::Test {
 protected:
  Objects() { host_.start_server(); }
  [[nodiscard]] RunResult run(std::vector<std::string> arguments) const {
    return run_plcctl(domain_.number(), std::move(arguments));
  }
  [[nodiscard]] Json json(std::vector<std::string> arguments) const {
    arguments.emplace_back("--json");
    const auto result = run(std::move(arguments));
    EXPECT_EQ(result.code, 0) << result.errors;
    return Json::parse(result.output);
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  ObjectPool pool_ = ObjectPool::attach(host_.pool_name()).value();
};

TEST_F(Objects, AreListedWithWhatTheirTypeHas) {
  const PoolEvent ready = host_.add_event("line1", "ready");
  ready.set_bound_tasks(2);
  (void)ready.post();
  const auto semaphore = pool_.create_semaphore("slots", 7).value();
  const auto memory = pool_.create_memory("image", 4096, {.keep = true, .mode = 0640}).value();
  const auto mutex = pool_.create_mutex("recipe").value();
  ASSERT_EQ(mutex.object.lock(), plchost::ObjectStatus::done);
  const Json all = json({"list", "objects"});
  ASSERT_EQ(all.size(), 4U) << all;
  std::vector<std::string> names;
  for (const Json& object : all) names.push_back(object["object"]);
  EXPECT_THAT(names, ElementsAre("image", "line1/ready", "recipe", "slots")) << "by name";
  EXPECT_EQ(all[0]["type"], "memory");
  EXPECT_EQ(all[0]["size_bytes"], 4096);
  EXPECT_EQ(all[0]["mode"], "0640");
  EXPECT_EQ(all[0]["kept"], true);
  EXPECT_EQ(all[0]["references"][0]["pid"], ::getpid());
  EXPECT_EQ(all[1]["value"], 1);
  EXPECT_EQ(all[1]["registered"], true);
  EXPECT_EQ(all[1]["bound_tasks"], 2);
  EXPECT_EQ(all[2]["held"], true);
  EXPECT_EQ(all[2]["holder_pid"], ::getpid());
  EXPECT_EQ(all[2]["holder_program"], "integration_api");
  EXPECT_EQ(all[3]["value"], 7);
  const auto table = run({"list", "objects"}).output;
  EXPECT_THAT(
      table, AllOf(HasSubstr("HOST"), HasSubstr("OBJECT"), HasSubstr("WAITERS"), HasSubstr("REFS"),
                   HasSubstr(fmt::format("integration_api({})", ::getpid())),
                   HasSubstr(fmt::format("held by integration_api({}), thread {}", ::getpid(), ::getpid()))));
  EXPECT_TRUE(pool_.remove_object("image")) << "a kept one would outlive the test";
}

TEST_F(Objects, AreFilteredByTheHost) {
  (void)host_.add_event("line1", "ready");
  (void)host_.add_event("line2", "ready");
  const auto memory = pool_.create_memory("line1/image", 64).value();
  EXPECT_EQ(json({"list", "objects", "line1/*"}).size(), 2U);
  EXPECT_EQ(json({"list", "objects", "--type", "event"}).size(), 2U);
  EXPECT_EQ(json({"list", "objects", "line1/*", "--type", "event"}).size(), 1U);
  EXPECT_EQ(json({"list", "objects", "line3/*"}).size(), 0U);
  const auto wrong = run({"list", "objects", "--type", "evnt"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.errors, HasSubstr("memory, semaphore, event, mutex"));
}

TEST_F(Objects, ShowWhoHoldsThemAndWhoWaits) {
  const auto semaphore = pool_.create_semaphore("slots", 0).value();
  std::jthread waiter([&] { EXPECT_EQ(semaphore.object.wait(soon()), plchost::ObjectStatus::done); });
  Json shown;
  do shown = json({"show", "object", "slots"}).at(0);
  while (shown["waiters"] == 0);
  EXPECT_EQ(shown["references"][0]["waiting"], 1);
  const auto text = run({"show", "object", "slots"});
  EXPECT_THAT(text.output, AllOf(HasSubstr("waiters"), HasSubstr("PROGRAM"), HasSubstr("integration_api"),
                                 HasSubstr("mode"), Not(HasSubstr("size_bytes"))));
  ASSERT_EQ(semaphore.object.post(), plchost::ObjectStatus::done);
}

TEST_F(Objects, ThatAreNotThereAreNoneOfAnyoneElse) {
  const auto memory = pool_.create_memory("line1/image", 64).value();
  const auto wrong = run({"show", "object", "line1/imgae"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_THAT(wrong.errors, HasSubstr("did you mean 'line1/image'?"));
  EXPECT_EQ(run({"watch", "object", "line1/imgae"}).code, 1);
  EXPECT_EQ(run({"show", "object", "a\x1b[2J"}).code, 2);
  EXPECT_EQ(run({"show", "object", std::string(96, 'a')}).code, 2);
}

// The output of plcctl so far, line by line.
class Watch {
 public:
  Watch(const OwnDomain& domain, std::vector<std::string> arguments) : file_(own_path("watch")) {
    arguments.insert(arguments.begin(),
                     {"--domain", std::to_string(domain.number()), "--timeout", "10", "watch", "object"});
    child_.emplace(PLCCTL_PROGRAM, arguments, file_);
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  ~Watch() {
    child_.reset();
    std::filesystem::remove(file_);
    std::filesystem::remove(file_ + ".errors");
  }
  [[nodiscard]] std::vector<std::string> lines() const { return whole_lines(file_); }
  // The lines as soon as there are so many.
  [[nodiscard]] std::vector<std::string> wait_for(std::size_t count) const {
    while (lines().size() < count && MonotonicClock::now() < deadline_) ::usleep(5000);
    return lines();
  }
  [[nodiscard]] Child& child() { return *child_; }

 private:
  std::string file_;
  std::optional<Child> child_;
  TimePoint deadline_ = soon();
};

TEST_F(Objects, AreWatchedWithALineForEachChange) {
  auto memory = pool_.create_semaphore("slots", 3);
  Watch watch(domain_, {"slots", "--interval", "0.02"});
  ASSERT_EQ(watch.wait_for(1).size(), 1U);
  EXPECT_THAT(watch.lines()[0], AllOf(HasSubstr("slots"), HasSubstr("value 3")));
  ASSERT_EQ(memory->object.post(), plchost::ObjectStatus::done);
  ASSERT_EQ(watch.wait_for(2).size(), 2U);
  EXPECT_THAT(watch.lines()[1], HasSubstr("value 4"));
  memory->object.close();
  ASSERT_EQ(watch.wait_for(3).size(), 3U);
  EXPECT_THAT(watch.lines()[2], HasSubstr("is not there"));
  memory = pool_.create_semaphore("slots", 9);
  ASSERT_EQ(watch.wait_for(4).size(), 4U);
  EXPECT_THAT(watch.lines()[3], HasSubstr("value 9"));
  watch.child().signal(SIGINT);
  EXPECT_EQ(watch.child().wait(), 0);
  EXPECT_EQ(watch.lines().size(), 4U) << "nothing is said of the unchanged ones";
}

TEST_F(Objects, AreWatchedAsOneObjectOfJsonEach) {
  const auto semaphore = pool_.create_semaphore("slots", 3).value();
  const auto result = run({"watch", "object", "slots", "--count", "1", "--json"});
  EXPECT_EQ(result.code, 0) << result.errors;
  const Json line = Json::parse(result.output);
  EXPECT_EQ(line["value"], 3);
  EXPECT_EQ(line["present"], true);
  EXPECT_GT(line["time_unix_ns"], 0);
}

TEST(ManyObjects, AreListedPageByPageWhileTheHostAnswers) {
  constexpr std::size_t kMany = 10'000;
  const OwnDomain domain;
  TestHost host(domain, "hosta", 16'384);
  ObjectPool pool = ObjectPool::attach(host.pool_name()).value();
  (void)host.add_event("line1", "ready");
  std::vector<SharedSemaphore> held;
  for (std::size_t i = 0; i < kMany; ++i) {
    held.push_back(pool.create_semaphore(fmt::format("store/{:05}", i), 1).value().object);
  }
  host.start_server();
  const auto client = connect(domain);
  ASSERT_TRUE(client->host("hosta", soon()));
  std::vector<std::string> names;
  std::size_t pages = 0;
  for (ObjectQuery query;; ++pages) {
    const auto listing = client->list_objects("hosta", query, soon()).value();
    for (const ListedObject& object : listing.objects) names.emplace_back(object.name());
    if (listing.complete) break;
    query.after = listing.next_after;
  }
  EXPECT_GE(pages, kMany / kPageObjects);
  ASSERT_EQ(names.size(), kMany + 1);
  EXPECT_TRUE(std::ranges::is_sorted(names));
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
  EXPECT_EQ(client->list_objects("hosta", {.name = "store/09999"}, soon()).value().objects.size(), 1U);
  EXPECT_EQ(client->host("hosta", soon()).value().status.objects, kMany + 1) << "all, whatever their number";
  ASSERT_EQ(client->events("hosta", soon()).value().size(), 1U);
  const auto result = run_plcctl(domain.number(), {"list", "objects", "--json"});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_EQ(Json::parse(result.output).size(), kMany + 1);
  const auto hosts = run_plcctl(domain.number(), {"list", "hosts", "--json"});
  EXPECT_EQ(Json::parse(hosts.output).at(0).at("objects"), kMany + 1) << hosts.output;
}

TEST(ManyEvents, AreShownUpToABoundThoseInUseFirst) {
  constexpr std::size_t kMany = 5'000;
  const OwnDomain domain;
  TestHost host(domain, "hosta", 8'192);
  ObjectPool pool = ObjectPool::attach(host.pool_name()).value();
  (void)host.add_event("zone9", "ready");  // by name it would be the last
  std::vector<SharedEvent> unused;
  for (std::size_t i = 0; i < kMany; ++i) {
    const std::string name = fmt::format("line1/{:05}", i);
    unused.push_back(pool.create_shared_event(name).value().object);
    pool.create_event(name).value().set_registered(false);
  }
  host.start_server();
  const auto client = connect(domain);
  const auto events = client->events("hosta", soon()).value();
  ASSERT_EQ(events.size(), 4'096U);
  EXPECT_STREQ(events.back().event, "ready");
  EXPECT_EQ(client->host("hosta", soon()).value().status.objects, kMany + 1);
}

TEST_F(Objects, AreCountedByTheStatusOfTheHost) {
  const auto client = connect(domain_);
  const auto counted = [&] { return client->host("hosta", soon()).value().status.objects; };
  const TimePoint end = soon();
  const auto becomes = [&](std::uint32_t count) {
    while (counted() != count && MonotonicClock::now() < end) std::this_thread::yield();
    return counted() == count;
  };
  EXPECT_TRUE(becomes(0));
  std::optional semaphore = pool_.create_semaphore("slots", 1).value();
  EXPECT_TRUE(becomes(1));
  semaphore.reset();
  EXPECT_TRUE(becomes(0));
}

}  // namespace
}  // namespace plchost
