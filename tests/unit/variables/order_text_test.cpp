#include "shm/variables/order_text.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

TEST(OrderText, TellsTheValuesToThoseAloneThatMayReadThem) {
  const std::string text = order_text("Pump[1,2].speed", false, "'a: b'", "'c'");
  EXPECT_EQ(text, "'Pump[1,2].speed' is written: 'a: b' -> 'c'");
  EXPECT_EQ(without_values(text), "'Pump[1,2].speed' is written");
  EXPECT_EQ(without_values(order_text("n", true, "1", "2")), "'n' is forced");
}

}  // namespace
}  // namespace plchost
