// Lists of variables whose instance lets the API server wait.
#include "api/server/lists/variable_lister.hpp"

#include <filesystem>
#include <string>

#include <gmock/gmock.h>

#include "shm/sockets/packet_socket.hpp"
#include "shm/variables/symbol_page.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

class VariableListerTest : public testing::Test {
 protected:
  VariableListerTest() { std::filesystem::create_directory(folder_); }
  ~VariableListerTest() override {
    for (const char* const instance : {"line1", "line2"}) SymbolPage::remove(pool_, instance);
    std::filesystem::remove_all(folder_);
  }
  struct Instance {
    SymbolPage page;
    PacketListener listener;
  };
  Instance instance(const std::string& name) {
    const std::array symbols{VariableSymbol{.name = "n", .type = VariableType::int_, .bytes = 2}};
    return {.page = SymbolPage::create(pool_, name, symbols).value(),
            .listener = PacketListener::listen(values_socket_path(folder_, name)).value()};
  }
  /// As another client each time.
  Result<void> begin(const std::string& name, Duration patience) {
    VariableLister::Asker asker{.client = {}, .identity = {}, .instance = name};
    asker.client.bytes[0] = static_cast<std::uint8_t>(++asked_);
    asker.identity.sequence_number = asked_;
    return sut_.begin(std::move(asker), {.patterns = {"n"}}, now_, now_ + patience);
  }
  static ValueRequest asked(PacketSocket& peer) {
    return decode_value_request(peer.receive().value().value()).value();
  }
  static void answer(PacketSocket& peer, const ValueRequest& request) {
    const ValueReply reply{.number = request.number,
                           .elements = request.elements,
                           .forced = {0},
                           .values = {std::byte{5}, std::byte{0}}};
    for (const std::string& packet : encode(reply)) ASSERT_TRUE(peer.send(packet));
  }

  const std::string folder_ = own_path("values");
  const std::string pool_ = own_name("lister");
  VariableLister sut_ = VariableLister::create(pool_, folder_).value();
  const TimePoint now_ = MonotonicClock::now();
  std::int64_t asked_ = 0;
};

TEST_F(VariableListerTest, WaitsAsLongAsEachClientDoes) {
  auto line1 = instance("line1");
  ASSERT_TRUE(begin("line1", seconds(9)));
  ASSERT_TRUE(begin("line1", seconds(2)));
  EXPECT_TRUE(sut_.expire(now_ + seconds(1)).empty());
  const auto second = sut_.expire(now_ + seconds(2));
  ASSERT_EQ(second.size(), 1U) << "the other one waits on";
  EXPECT_EQ(second.front().asker.identity.sequence_number, 2);
  EXPECT_EQ(second.front().listing.error().code, ErrorCode::timed_out);
  EXPECT_THAT(second.front().listing.error().message,
              HasSubstr("instance 'line1': it has not answered within 2000 ms"));
  EXPECT_EQ(sut_.expire(now_ + seconds(9)).size(), 1U);
}

TEST_F(VariableListerTest, AsksAnInstanceThatAnswersLateForThoseAloneThatStillWait) {
  auto line1 = instance("line1");
  for (const int patience : {1, 1, 9}) ASSERT_TRUE(begin("line1", seconds(patience)));
  EXPECT_EQ(sut_.expire(now_ + seconds(1)).size(), 2U);
  PacketSocket peer = *line1.listener.accept().value();
  answer(peer, asked(peer));
  EXPECT_TRUE(sut_.receive().empty()) << "its client has given up";
  answer(peer, asked(peer));
  const auto last = sut_.receive();
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(last.front().asker.identity.sequence_number, 3);
  ASSERT_TRUE(last.front().listing) << last.front().listing.error().describe();
  EXPECT_FALSE(peer.receive().value()) << "nobody waits for more";
}

TEST_F(VariableListerTest, LetsOneInstanceThatDoesNotAnswerTakeNotAllPlaces) {
  auto line1 = instance("line1");
  auto line2 = instance("line2");
  for (std::size_t i = 0; i < VariableLister::kMaxPendingOfInstance; ++i)
    ASSERT_TRUE(begin("line1", seconds(9)));
  EXPECT_EQ(begin("line1", seconds(9)).error().code, ErrorCode::busy);
  EXPECT_TRUE(begin("line2", seconds(9)));
}

TEST_F(VariableListerTest, WaitsForNobodyLongerThanAnHour) {
  auto line1 = instance("line1");
  ASSERT_TRUE(begin("line1", std::chrono::hours(100)));
  EXPECT_EQ(sut_.expire(now_ + VariableLister::kMostPatience).size(), 1U);
}

}  // namespace
}  // namespace plchost
