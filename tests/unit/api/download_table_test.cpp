#include "api/server/downloads/download_table.hpp"

#include <filesystem>
#include <fstream>
#include <optional>

#include <gmock/gmock.h>

#include "api/control/application_order.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::uint64_t kLimit = 1000;

class Downloads : public testing::Test {
 protected:
  Downloads() : pool_(own_name("downloads")) { sut_.emplace(pool_, kLimit); }
  ~Downloads() override { remove_downloads(pool_); }

  static plc_SampleIdentity identity(std::int64_t number, std::uint8_t client = 1) {
    plc_SampleIdentity made{};
    made.writer_guid[0] = client;
    made.sequence_number = number;
    return made;
  }
  static dds::Guid client(std::uint8_t number = 1) {
    dds::Guid guid;
    guid.bytes[0] = number;
    return guid;
  }
  static ControlRequest request(const std::string& instance, std::uint64_t size) {
    return {.number = 0,
            .verb = ControlVerb::download_application,
            .instance = instance,
            .argument = "lamp.so",
            .options = {{"size", std::to_string(size)}, {"sha256", std::string(64, '0')}}};
  }
  Result<void> begin(std::int64_t number, const std::string& instance, std::uint64_t size) {
    return sut_->begin(client(), identity(number), request(instance, size), now_);
  }
  void take(std::int64_t number, std::uint64_t offset, std::string bytes, std::uint8_t from = 1) {
    plc_DownloadChunk chunk{};
    chunk.download = identity(number);
    chunk.offset = offset;
    chunk.contents._buffer = reinterpret_cast<std::uint8_t*>(bytes.data());
    chunk.contents._length = static_cast<std::uint32_t>(bytes.size());
    sut_->take(chunk, client(from), now_);
  }
  std::vector<DownloadEnd> given_up(bool alive = true) {
    return sut_->given_up(now_, [alive](const dds::Guid&) { return alive; });
  }
  /// How far the only download that has news is.
  std::optional<std::uint64_t> received() {
    const auto all = sut_->progress();
    return all.size() == 1 ? std::optional(all.front().received) : std::nullopt;
  }
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
      if (entry.path().filename().string().starts_with(pool_)) all.push_back(entry.path().string());
    }
    return all;
  }

  std::string pool_;
  std::optional<DownloadTable> sut_;
  TimePoint now_{std::chrono::seconds(100)};
};

TEST_F(Downloads, PassOverNamesThatOthersHaveTaken) {
  std::filesystem::create_directory(download_file_name(pool_, 1));
  std::ofstream(download_file_name(pool_, 2)) << "planted";
  const auto begun = begin(1, "line1", 10);
  EXPECT_TRUE(begun) << begun.error().describe();
  EXPECT_THAT(files(), testing::Contains(download_file_name(pool_, 3)));
  remove_downloads(pool_);
  EXPECT_THAT(files(), IsEmpty()) << "the folder, too";
}

TEST_F(Downloads, AreCompleteWhenAllPiecesHaveComeInTheirOrder) {
  ASSERT_TRUE(begin(1, "line1", 5));
  EXPECT_EQ(received(), 0U);
  EXPECT_EQ(received(), std::nullopt);
  take(1, 0, "abc");
  EXPECT_EQ(received(), 3U);
  EXPECT_THAT(sut_->complete(), IsEmpty());
  take(1, 3, "de");
  EXPECT_EQ(received(), 5U);
  const auto complete = sut_->complete();
  ASSERT_THAT(complete, SizeIs(1));
  EXPECT_EQ(complete[0].request.instance, "line1");
  const std::string source = complete[0].request.options.at("source");
  std::string contents;
  std::ifstream(download_file_name(pool_, std::stoull(source))) >> contents;
  EXPECT_EQ(contents, "abcde");
  EXPECT_THAT(sut_->complete(), IsEmpty());
  sut_->end(complete[0].identity);
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(Downloads, TakeNoPieceTwiceAndNoneAfterAGapAndSayWhereToGoOn) {
  ASSERT_TRUE(begin(1, "line1", 6));
  (void)received();
  take(1, 2, "cd");
  EXPECT_EQ(received(), 0U);
  take(1, 0, "ab");
  take(1, 0, "xy");
  EXPECT_EQ(received(), 2U);
  take(1, 1, "zz");
  EXPECT_EQ(received(), 2U);
  take(1, UINT64_MAX, "zz");
  take(1, 2, "");
  EXPECT_EQ(received(), 2U);
  EXPECT_THAT(given_up(), IsEmpty());
}

TEST_F(Downloads, TakeNoPieceFromAnotherClientOrOfAnotherDownload) {
  ASSERT_TRUE(begin(1, "line1", 2));
  (void)received();
  take(1, 0, "ab", /*from=*/2);
  take(2, 0, "ab");
  EXPECT_EQ(received(), std::nullopt);
  EXPECT_THAT(sut_->complete(), IsEmpty());
}

TEST_F(Downloads, EndWhenMoreComesThanWasAnnounced) {
  ASSERT_TRUE(begin(1, "line1", 2));
  take(1, 0, "abc");
  const auto ends = given_up();
  ASSERT_THAT(ends, SizeIs(1));
  EXPECT_EQ(ends[0].why.code, ErrorCode::invalid_argument);
  EXPECT_THAT(sut_->complete(), IsEmpty());
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(Downloads, EndWhenNothingComesForSoLong) {
  ASSERT_TRUE(begin(1, "line1", 4));
  now_ += DownloadTable::kPatience - std::chrono::milliseconds(1);
  take(1, 0, "ab");
  now_ += DownloadTable::kPatience - std::chrono::milliseconds(1);
  take(1, 0, "ab");  // nothing new
  EXPECT_THAT(given_up(), IsEmpty());
  now_ += std::chrono::milliseconds(1);
  const auto ends = given_up();
  ASSERT_THAT(ends, SizeIs(1));
  EXPECT_EQ(ends[0].why.code, ErrorCode::timed_out);
  EXPECT_THAT(ends[0].why.message, HasSubstr("2 of 4 bytes of lamp.so"));
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(Downloads, EndAtOnceWhenTheirClientIsGone) {
  ASSERT_TRUE(begin(1, "line1", 4));
  EXPECT_THAT(given_up(/*alive=*/false), SizeIs(1));
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(Downloads, GoOnWhenTheirClientIsGoneAfterTheLastPiece) {
  ASSERT_TRUE(begin(1, "line1", 1));
  take(1, 0, "a");
  ASSERT_THAT(sut_->complete(), SizeIs(1));
  EXPECT_THAT(given_up(/*alive=*/false), IsEmpty());
  now_ += 2 * DownloadTable::kPatience;
  EXPECT_THAT(given_up(), IsEmpty());
  EXPECT_THAT(files(), SizeIs(1));
}

TEST_F(Downloads, AreOneForEachInstance) {
  ASSERT_TRUE(begin(1, "line1", 4));
  const auto second = begin(2, "line1", 4);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::busy);
  EXPECT_THAT(second.error().message, HasSubstr("'line1' is just being sent another one"));
  EXPECT_TRUE(begin(3, "line2", 4));
}

TEST_F(Downloads, AreBoundedInNumberAndSize) {
  const auto large = begin(1, "line1", kLimit + 1);
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, ErrorCode::full);
  EXPECT_THAT(large.error().message, HasSubstr("application_limit_mib"));
  ASSERT_TRUE(begin(2, "line1", kLimit));
  ASSERT_TRUE(begin(3, "line2", kLimit - 1));
  EXPECT_EQ(begin(4, "line3", 2).error().code, ErrorCode::busy);
  ASSERT_TRUE(begin(5, "line3", 1));
  sut_->end(identity(2));
  ASSERT_TRUE(begin(6, "line4", 1));
  ASSERT_TRUE(begin(7, "line5", 1));
  EXPECT_EQ(begin(8, "line6", 1).error().code, ErrorCode::busy);
  EXPECT_EQ(sut_->size(), DownloadTable::kMost);
}

TEST_F(Downloads, AreToldAgainWhenTheirRequestComesAgain) {
  ASSERT_TRUE(begin(1, "line1", 4));
  take(1, 0, "ab");
  (void)received();
  EXPECT_TRUE(sut_->repeat(identity(1)));
  EXPECT_EQ(received(), 2U);
  EXPECT_FALSE(sut_->repeat(identity(2)));
}

TEST_F(Downloads, LeaveNothingInSharedMemory) {
  ASSERT_TRUE(begin(1, "line1", 4));
  EXPECT_THAT(files(), SizeIs(1));
  sut_.reset();
  EXPECT_THAT(files(), IsEmpty());
  std::ofstream(download_file_name(pool_, 7)) << "of a killed server";
  sut_.emplace(pool_, kLimit);
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(Downloads, OfWhichAFileCannotBeMadeAreRefused) {
  sut_.emplace(std::string(300, 'x'), kLimit);  // no name of a file is so long
  EXPECT_EQ(begin(1, "line1", 4).error().code, ErrorCode::system);
  EXPECT_EQ(sut_->size(), 0U);
}

}  // namespace
}  // namespace plchost
