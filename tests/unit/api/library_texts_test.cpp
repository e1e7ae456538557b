#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <library_conversions.hpp>

namespace plchost {
namespace {

// The text of an exception is that of an application, and a long one is cut within a letter. Python refuses
// bytes that are no UTF-8.
TEST(TextsOfTheLibrary, AreUtf8WhateverTheSampleHas) {
  plc_ExceptionStatus sample{};
  dds::copy_text(sample.text,
                 "\xdc"
                 "berlauf\x1b[2J");
  EXPECT_EQ(to_public(sample).text, "?berlauf?[2J");
}

TEST(TextsOfTheLibrary, KeepTheirLines) {
  plc_ExceptionStatus sample{};
  dds::copy_text(sample.text, "one\n\x1btwo\n");
  EXPECT_EQ(to_public(sample).text, "one\n?two\n");
}

TEST(TextsOfTheLibrary, AreUtf8InListsToo) {
  plc_HostStatus sample{};
  dds::copy_text(sample.labels, "press,\xff");
  EXPECT_THAT(to_public(sample).labels, testing::ElementsAre("press", "?"));
}

}  // namespace
}  // namespace plchost
