#include "api/server/access/request_check.hpp"

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "api/dds/text.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

constexpr std::array<std::string_view, 2> kInstances{"line1", "line2"};

plc_Request make(std::int32_t operation, std::string_view instance = "line1", std::string_view argument = "",
                 std::string_view host = "hosta") {
  plc_Request request{};
  dds::copy_text(request.header.instance_name, host);
  request.operation = operation;
  dds::copy_text(request.instance, instance);
  dds::copy_text(request.argument, argument);
  return request;
}

Result<ControlRequest> check(const plc_Request& request, ApiRole role) {
  return check_request(request, role, "hosta", kInstances);
}

TEST(RequestCheck, TakesTheNameAndTheValueOfAVariable) {
  const auto asked = [](std::int32_t operation, std::string_view argument) {
    return check(make(operation, "line1", argument), ApiRole::operating);
  };
  for (const auto operation : {plc_OPERATION_WRITE_VARIABLE, plc_OPERATION_FORCE_VARIABLE}) {
    EXPECT_EQ(asked(operation, "Line.speed=5")->argument, "Line.speed=5");
    EXPECT_EQ(asked(operation, "Line.text='a=b'")->argument, "Line.text='a=b'");
    EXPECT_EQ(asked(operation, "Line.text=")->argument, "Line.text=");
    for (const char* const wrong : {"", "=5", "Line.speed", "Line.speed=\x1b[2J"}) {
      const auto refused = asked(operation, wrong);
      ASSERT_FALSE(refused) << wrong;
      EXPECT_THAT(refused.error().message, HasSubstr("is not of the form NAME=VALUE"));
    }
  }
  EXPECT_EQ(asked(plc_OPERATION_UNFORCE_VARIABLE, "*")->argument, "*");
  EXPECT_EQ(asked(plc_OPERATION_UNFORCE_VARIABLE, "Grid[1,2]")->argument, "Grid[1,2]");
  EXPECT_FALSE(asked(plc_OPERATION_UNFORCE_VARIABLE, ""));
  EXPECT_FALSE(asked(plc_OPERATION_UNFORCE_VARIABLE, "a=5"));
}

TEST(RequestCheck, TurnsEachOperationIntoItsVerb) {
  EXPECT_EQ(check(make(plc_OPERATION_START), ApiRole::operating)->verb, ControlVerb::start);
  EXPECT_EQ(check(make(plc_OPERATION_STOP), ApiRole::operating)->verb, ControlVerb::stop);
  EXPECT_EQ(check(make(plc_OPERATION_RESET), ApiRole::operating)->verb, ControlVerb::reset);
  EXPECT_EQ(check(make(plc_OPERATION_RESTART), ApiRole::operating)->verb, ControlVerb::restart);
  const auto load = check(make(plc_OPERATION_LOAD_APPLICATION, "line2", "/a/b.so"), ApiRole::engineering);
  EXPECT_EQ(load->verb, ControlVerb::load_application);
  EXPECT_EQ(load->instance, "line2");
  EXPECT_EQ(load->argument, "/a/b.so");
  EXPECT_EQ(check(make(plc_OPERATION_SET_SCHEDULER, "line1", "CmpSchedule"), ApiRole::engineering)->verb,
            ControlVerb::set_scheduler);
  EXPECT_EQ(check(make(plc_OPERATION_REGISTER_EVENT, "line1", "e"), ApiRole::engineering)->verb,
            ControlVerb::register_event);
  EXPECT_EQ(check(make(plc_OPERATION_UNREGISTER_EVENT, "line1", "e"), ApiRole::engineering)->verb,
            ControlVerb::unregister_event);
  EXPECT_EQ(check(make(plc_OPERATION_CHECK_HOST, ""), ApiRole::operating)->verb, ControlVerb::check_host);
  EXPECT_EQ(check(make(plc_OPERATION_LIST_OBJECTS, ""), ApiRole::operating)->verb, ControlVerb::list_objects);
  EXPECT_EQ(check(make(plc_OPERATION_LIST_NODES, ""), ApiRole::operating)->verb, ControlVerb::list_nodes);
  EXPECT_EQ(check(make(plc_OPERATION_LIST_ROUTES, ""), ApiRole::operating)->verb, ControlVerb::list_routes);
  EXPECT_EQ(check(make(plc_OPERATION_READ_LOG), ApiRole::operating)->verb, ControlVerb::read_log);
  EXPECT_FALSE(check(make(plc_OPERATION_READ_LOG, ""), ApiRole::operating)) << "of one instance";
  EXPECT_EQ(check(make(plc_OPERATION_READ_TRACE), ApiRole::operating)->verb, ControlVerb::read_trace);
  EXPECT_FALSE(check(make(plc_OPERATION_READ_TRACE), ApiRole::viewing)) << "as the log";
  EXPECT_EQ(check(make(plc_OPERATION_LIST_VARIABLES), ApiRole::viewing)->verb, ControlVerb::list_variables);
  EXPECT_EQ(check(make(plc_OPERATION_READ_DEBUG), ApiRole::engineering)->verb, ControlVerb::read_debug);
  EXPECT_FALSE(check(make(plc_OPERATION_READ_DEBUG, "line1", "3 500"), ApiRole::engineering)) << "text";
  for (const char* task : {"", "Main"}) {
    const auto reset = check(make(plc_OPERATION_RESET_STATISTICS, "line1", task), ApiRole::operating);
    EXPECT_EQ(reset->verb, ControlVerb::reset_statistics);
    EXPECT_EQ(reset->argument, task);
  }
}

TEST(RequestCheck, TakesACheckOfTheHostOnlyWithoutAnInstance) {
  const auto named = check(make(plc_OPERATION_CHECK_HOST, "line1"), ApiRole::operating);
  EXPECT_EQ(named.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(named.error().message, HasSubstr("whole host"));
}

TEST(RequestCheck, RefusesWhatIsNotForTheRole) {
  EXPECT_EQ(check(make(plc_OPERATION_SET_SCHEDULER, "line1", "x"), ApiRole::operating).error().code,
            ErrorCode::refused);
  EXPECT_EQ(check(make(plc_OPERATION_START), ApiRole::engineering).error().code, ErrorCode::refused);
  const auto viewing = check(make(plc_OPERATION_START), ApiRole::viewing);
  EXPECT_EQ(viewing.error().code, ErrorCode::refused);
  EXPECT_THAT(viewing.error().message,
              HasSubstr("does not belong to the topic plc/v1/all/request: write it to plc/v1/op/request"));
}

TEST(RequestCheck, NamesWhatDoesNotExist) {
  const auto instance = check(make(plc_OPERATION_START, "line3"), ApiRole::operating);
  EXPECT_EQ(instance.error().code, ErrorCode::not_found);
  EXPECT_THAT(instance.error().message, testing::AllOf(HasSubstr("line3"), HasSubstr("line1, line2")));
  const auto host = check(make(plc_OPERATION_START, "line1", "", "hostb"), ApiRole::operating);
  EXPECT_EQ(host.error().code, ErrorCode::not_found);
  EXPECT_THAT(host.error().message, HasSubstr("hostb"));
  const auto operation = check(make(99), ApiRole::operating);
  EXPECT_EQ(operation.error().code, ErrorCode::unsupported);
  EXPECT_THAT(operation.error().message, testing::AllOf(HasSubstr("5"), HasSubstr("set scheduler")));
}

plc_Request engineering(std::int32_t operation, std::string_view argument = "") {
  return make(operation, "line1", argument);
}

TEST(RequestCheck, TakesWhatAnApplicationIsLoadedWith) {
  using Options = std::map<std::string, std::string>;
  for (const auto& [operation, argument] : {std::pair(plc_OPERATION_LOAD_APPLICATION, "/a.so"),
                                            std::pair(plc_OPERATION_ROLLBACK_APPLICATION, "")}) {
    plc_Request request = engineering(operation, argument);
    EXPECT_EQ(check(request, ApiRole::engineering)->options, Options{});
    request.boot = true;
    EXPECT_EQ(check(request, ApiRole::engineering)->options, (Options{{"boot", "yes"}}));
    request.online = true;
    EXPECT_EQ(check(request, ApiRole::engineering)->options, (Options{{"boot", "yes"}, {"online", "yes"}}));
  }
}

TEST(RequestCheck, RefusesOptionsThatTheOperationDoesNotHave) {
  plc_Request request = engineering(plc_OPERATION_REGISTER_EVENT, "ready");
  request.online = true;
  const auto online = check(request, ApiRole::engineering);
  ASSERT_FALSE(online);
  EXPECT_EQ(online.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(online.error().message, HasSubstr("register event takes no option 'online'"));
  request = engineering(plc_OPERATION_LOAD_APPLICATION, "/a.so");
  request.size = 12;
  const auto size = check(request, ApiRole::engineering);
  ASSERT_FALSE(size);
  EXPECT_THAT(size.error().message, HasSubstr("takes no 'size'"));
}

TEST(RequestCheck, TakesADownloadWithItsSizeAndDigestOnly) {
  const std::string digest(64, 'f');
  const auto sent = [](const char* name, std::uint64_t size, std::string_view sha256) {
    plc_Request request = engineering(plc_OPERATION_DOWNLOAD_APPLICATION, name);
    request.size = size;
    dds::copy_text(request.sha256, sha256);
    return check(request, ApiRole::engineering);
  };
  const auto good = sent("a b.so", 12, digest);
  ASSERT_TRUE(good) << good.error().message;
  EXPECT_EQ(good->options, (std::map<std::string, std::string>{{"size", "12"}, {"sha256", digest}}));
  for (const auto& [size, sha256] :
       {std::pair(0, std::string()), std::pair(12, std::string()), std::pair(0, digest),
        std::pair(12, std::string(64, 'F')), std::pair(12, std::string(63, 'f'))}) {
    const auto refused = sent("a.so", static_cast<std::uint64_t>(size), sha256);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
  }
  for (const char* name : {"", "a/b.so", "a\nb", "\xff"}) EXPECT_FALSE(sent(name, 12, digest)) << name;
}

TEST(RequestCheck, RefusesImpossibleArguments) {
  const auto code = [](std::int32_t operation, std::string_view argument, ApiRole role) {
    return check(make(operation, "line1", argument), role).error().code;
  };
  EXPECT_EQ(code(plc_OPERATION_START, "x", ApiRole::operating), ErrorCode::invalid_argument);
  EXPECT_EQ(code(plc_OPERATION_LOAD_APPLICATION, "b.so", ApiRole::engineering), ErrorCode::invalid_argument);
  EXPECT_EQ(code(plc_OPERATION_LOAD_APPLICATION, "", ApiRole::engineering), ErrorCode::invalid_argument);
  EXPECT_EQ(code(plc_OPERATION_REGISTER_EVENT, "a/b", ApiRole::engineering), ErrorCode::invalid_argument);
  EXPECT_EQ(code(plc_OPERATION_SET_SCHEDULER, "", ApiRole::engineering), ErrorCode::invalid_argument);
  EXPECT_EQ(code(plc_OPERATION_RESET_STATISTICS, "a/b", ApiRole::operating), ErrorCode::invalid_argument);
  EXPECT_EQ(check(make(plc_OPERATION_START, ""), ApiRole::operating).error().code,
            ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace plchost
