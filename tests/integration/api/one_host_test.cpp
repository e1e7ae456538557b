// A client for one host among several: no other host sends it anything.
#include <array>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "api/client/client_core_status.hpp"
#include "api/plchost_client.hpp"
#include "tests/integration/api/readers_of.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// The samples that a client has received of that host and not taken yet.
template <class Sample>
std::size_t received_of(const ControlClient& client, std::string_view host) {
  std::size_t count = 0;
  for (const dds_entity_t reader : readers_of<Sample>(client)) {
    std::array<void*, 64> samples{};
    std::array<dds_sample_info_t, 64> infos{};
    const dds_return_t read = dds_read(reader, samples.data(), infos.data(), samples.size(), samples.size());
    for (int i = 0; i < read; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (dds::text_of(static_cast<const Sample*>(samples.at(at))->host) == host) ++count;
    }
    if (read > 0) (void)dds_return_loan(reader, samples.data(), read);
  }
  return count;
}

void until_it_is_so(const std::function<bool()>& happened) {
  bool has_happened = happened();
  for (const TimePoint end = soon(); !has_happened && MonotonicClock::now() < end; has_happened = happened())
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_TRUE(has_happened);
}

/// Two hosts of one domain, each with an instance, a task and an event.
class OneHost : public testing::Test {
 protected:
  OneHost() {
    for (TestHost* const host : {&first_, &second_}) {
      host->write_instance(0, "line1", InstanceState::running, 4711);
      host->write_count(1);
      host->add_event("line1", "ready").set_bound_tasks(1);
      host->start_server();
    }
  }
  [[nodiscard]] std::unique_ptr<ControlClient> connect_to(std::string_view host) const {
    dds::DomainOptions options;
    options.domain = domain_.number();
    return ControlClient::connect(options, host).value();
  }
  [[nodiscard]] RunResult run(std::vector<std::string> arguments) const {
    return run_plcctl(domain_.number(), std::move(arguments));
  }

  OwnDomain domain_;
  TestHost first_{domain_, "hosta"};
  TestHost second_{domain_, "hostb"};
  const InstancePage pages_[2] = {first_.make_page("line1", "Main", 4711),
                                  second_.make_page("line1", "Main", 4711)};
};

TEST_F(OneHost, IsTheOnlyOneThatSendsItsClientAnything) {
  const auto all = connect(domain_);
  const auto sut = connect_to("hosta");
  for (ControlClient* const client : {all.get(), sut.get()}) {
    ASSERT_TRUE(client->instances("hosta", soon()));
    ASSERT_TRUE(client->tasks("hosta", soon()));
    ASSERT_TRUE(client->statistics("hosta", "line1", "Main", soon()));
  }
  ASSERT_TRUE(all->instances("hostb", soon()));
  ASSERT_TRUE(all->statistics("hostb", "line1", "Main", soon()));

  second_.write_instance(0, "line1", InstanceState::stopped, 4711);
  // From here on neither takes what it receives.
  until_it_is_so([&] { return received_of<plc_InstanceStatus>(*all, "hostb") > 0; });
  until_it_is_so([&] { return received_of<plc_Presence>(*all, "hostb") > 0; });
  until_it_is_so([&] { return received_of<plc_Presence>(*sut, "hosta") > 0; });

  EXPECT_EQ(received_of<plc_Presence>(*sut, "hostb"), 0U);
  EXPECT_EQ(received_of<plc_InstanceStatus>(*sut, "hostb"), 0U);
  // Nor anything of the other topics: no reader has a writer of two hosts.
  const auto writers_of = [](const std::vector<dds_entity_t>& readers) {
    std::vector<dds_instance_handle_t> writers(8);
    return readers.size() == 1 ? dds_get_matched_publications(readers.front(), writers.data(), writers.size())
                               : -1;
  };
  EXPECT_EQ(writers_of(readers_of<plc_HostStatus>(*sut)), 1);
  EXPECT_EQ(writers_of(readers_of<plc_TaskStatus>(*sut)), 1);
  EXPECT_EQ(writers_of(readers_of<plc_TaskStatistics>(*sut)), 1);
  EXPECT_EQ(writers_of(readers_of<plc_TaskStatistics>(*all)), 2);
}

TEST_F(OneHost, IsCommandedAndPostedToAsByOthers) {
  const auto sut = connect_to("hosta");
  EXPECT_EQ(sut->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon()).value().code, ErrorCode::ok);
  EXPECT_EQ(sut->post_event({"hosta", "line1", "ready"}, 3, {}, kPatience).value().accepted, 3U);
  EXPECT_TRUE(sut->list_objects("hosta", {}, soon()));
  EXPECT_EQ(sut->hosts(soon()).size(), 1U);
  ASSERT_TRUE(sut->transitions());
}

TEST_F(OneHost, IsTheOnlyOneThatItsClientAddresses) {
  const auto sut = connect_to("hosta");
  const auto code_of = [](const auto& result) { return result ? ErrorCode::ok : result.error().code; };
  const auto no = ErrorCode::invalid_argument;
  EXPECT_EQ(code_of(sut->host("hostb", soon())), no);
  EXPECT_EQ(code_of(sut->instances("hostb", soon())), no);
  EXPECT_EQ(code_of(sut->statistics("hostb", "line1", "Main", soon())), no);
  EXPECT_EQ(code_of(sut->list_objects("hostb", {}, soon())), no);
  EXPECT_EQ(code_of(sut->call({"hostb", plc_OPERATION_STOP, "line1", ""}, soon())), no);
  EXPECT_EQ(code_of(sut->post_event({"hostb", "line1", "ready"}, 1, {}, kPatience)), no);
  EXPECT_EQ(code_of(sut->post_and_await({"hostb", "line1", "ready"}, kPatience)), no);
  const EventId ready{"line1", "ready"};
  EXPECT_EQ(code_of(sut->post_batch("hostb", std::span(&ready, 1), kPatience)), no);
  EXPECT_EQ(code_of(sut->check_host("hostb", soon())), no);
  EXPECT_THAT(sut->host("hostb", soon()).error().message, HasSubstr("for host 'hosta' only"));
  dds::DomainOptions options;
  options.domain = domain_.number();
  EXPECT_EQ(code_of(ControlClient::connect(options, "host*")), no) << "that would be a pattern of partitions";
}

TEST_F(OneHost, ThatDoesNotAnswerIsToldWithTheNamesOfThoseThatDo) {
  const auto sut = connect_to("hostc");
  std::string said;
  until_it_is_so([&] {
    said = sut->host("hostc", MonotonicClock::now() + std::chrono::milliseconds(50)).error().message;
    return said.contains("hosta") && said.contains("hostb");
  });
  EXPECT_THAT(said, HasSubstr("no host 'hostc' answers"));
  EXPECT_THAT(said, HasSubstr("those that do: hosta, hostb"));
}

TEST_F(OneHost, IsNamedToPlcctl) {
  EXPECT_THAT(run({"--host", "hostb", "list", "instances"}).output, HasSubstr("hostb"));
  EXPECT_THAT(run({"--host", "hostb", "list", "hosts"}).output,
              AllOf(HasSubstr("hostb"), Not(HasSubstr("hosta"))));
  EXPECT_EQ(run({"--host", "hostb", "stop", "instance", "line1"}).code, 0);
  EXPECT_EQ(run({"--host", "hostb", "post", "event", "line1/ready", "-q"}).code, 0);
  RunResult none;
  until_it_is_so([&] {
    none = run({"--host", "hostc", "--timeout", "1", "list", "hosts"});
    return none.errors.contains("hosta") && none.errors.contains("hostb");
  });
  EXPECT_EQ(none.code, 3);
  EXPECT_THAT(none.errors, HasSubstr("no host 'hostc' answers"));
  const auto offered = [&](std::vector<std::string> words) {
    words.insert(words.begin(),
                 {"__complete", "--domain", std::to_string(domain_.number()), "--timeout", "20"});
    return run_program(PLCCTL_PROGRAM, words).output;
  };
  until_it_is_so([&] { return offered({"--host", "hosta", "show", "instance", ""}) == "line1\trunning\n"; });
  until_it_is_so([&] {
    return offered({"--host", "hosta", "stop", "instance", "line1", "--host", "host"}) ==
           "hosta\t1 instance\nhostb\t1 instance\n";
  });
}

TEST_F(OneHost, IsAnOptionOfTheClientLibrary) {
  Client::Options options;
  options.domain = domain_.number();
  options.timeout = std::chrono::seconds(20);
  options.host = "hostb";
  Client sut(options);
  const auto code_of = [](const auto& call) {
    try {
      call();
    } catch (const ClientError& error) {
      return error.code();
    }
    return 0;
  };
  EXPECT_EQ(sut.instances().front().host, "hostb") << "without its name, although another one answers";
  EXPECT_EQ(sut.hosts().size(), 1U);
  EXPECT_EQ(sut.post("", "line1/ready").accepted, 1U);
  const auto no = static_cast<int>(ClientError::invalid_argument);
  EXPECT_EQ(code_of([&] { (void)sut.instances("hosta"); }), no);
  EXPECT_EQ(code_of([&] { (void)sut.post("hosta", "line1/ready"); }), no);
  EXPECT_EQ(code_of([&] { (void)sut.watch_tasks("hosta", [](const Client::Task&) {}); }), no);
  EXPECT_EQ(code_of([&] { (void)sut.watch_transitions("hosta", [](const Client::Transition&) {}); }), no);
  options.host = "no name";
  EXPECT_EQ(code_of([&] { const Client wrong(options); }), no);
}

}  // namespace
}  // namespace plchost
