// The bytes of a connection of the Debug Adapter Protocol.
#include "api/cli/debug/dap_messages.hpp"

#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/base/plain_json.hpp"

namespace plchost {
namespace {

using ::testing::HasSubstr;

std::string packet(const std::string& body) {
  return fmt::format("Content-Length: {}\r\n\r\n{}", body.size(), body);
}

std::string nested(int levels) {
  std::string body = R"({"a":)";
  for (int i = 1; i < levels; ++i) body += '[';
  if (levels == 1) body += '1';
  for (int i = 1; i < levels; ++i) body += ']';
  return body + "}";
}

std::string fault_of(const std::string& bytes) {
  DapReader sut;
  sut.add(bytes);
  const auto message = sut.next();
  return message ? "" : message.error().message;
}

TEST(DapMessages, AreReadFromAnyPiecesOfThem) {
  const std::string bytes = packet(R"({"seq":1})") + "content-length:9\r\ncontent-type: a\r\n\r\n{\"seq\":2}";
  for (std::size_t piece = 1; piece <= bytes.size(); ++piece) {
    DapReader sut;
    std::string seen;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      sut.add(bytes.substr(at, piece));
      for (auto message = sut.next(); message && *message; message = sut.next())
        seen += fmt::format("{} ", (**message)["seq"].get<int>());
    }
    EXPECT_EQ(seen, "1 2 ") << piece;
  }
}

TEST(DapMessages, AreReadAsTheyAreWritten) {
  DapReader sut;
  sut.add(dap_packet({{"text", "\xff\n\"{[\\"}}));
  const auto message = sut.next();
  ASSERT_TRUE(message && *message);
  EXPECT_THAT((**message)["text"].get<std::string>(), HasSubstr("\n\"{[\\"));
}

TEST(DapMessages, HaveALengthWithinBounds) {
  EXPECT_THAT(fault_of("Content-Type: a\r\n\r\n"), HasSubstr("no Content-Length"));
  for (const std::string length : {"", "-1", "1x", "0x10", "1048577", "99999999999999999999"})
    EXPECT_THAT(fault_of("Content-Length: " + length + "\r\n\r\n"), HasSubstr("from 0 to 1048576")) << length;
  EXPECT_EQ(fault_of("Content-Length: 1048576\r\n\r\n"), "") << "the rest is to come";
  EXPECT_EQ(fault_of(std::string(DapReader::kMaxHead, 'x')), "");
  EXPECT_THAT(fault_of(std::string(DapReader::kMaxHead + 1, 'x')), HasSubstr("longer than 1024 bytes"));
}

TEST(DapMessages, AreNoneOfAPageInABrowser) {
  EXPECT_THAT(fault_of("POST / HTTP/1.1\r\nHost: 127.0.0.1:4711\r\nContent-Length: 2\r\n\r\n{}"),
              HasSubstr("'POST / HTTP/1.1' is no line of a head"));
}

TEST(DapMessages, AreObjectsOfFewLevels) {
  for (const std::string body : {"", "5", "[]", "{}}", "{\"a\":}", "null", "{\"a\":\"\xff\"}"})
    EXPECT_THAT(fault_of(packet(body)), HasSubstr("no object of JSON")) << body;
  EXPECT_EQ(fault_of(packet(nested(kMaxJsonDepth))), "");
  EXPECT_THAT(fault_of(packet(nested(kMaxJsonDepth + 1))), HasSubstr("at most 32 levels"));
  EXPECT_THAT(fault_of(packet(nested(500'000))), HasSubstr("at most 32 levels"));
  EXPECT_EQ(fault_of(packet(R"({"a":"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[\"{{{"})")), "");
}

}  // namespace
}  // namespace plchost
