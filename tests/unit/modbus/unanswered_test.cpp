#include "instances/io/modbus/client/unanswered.hpp"

#include <cstddef>
#include <deque>

#include <gtest/gtest.h>

namespace plchost::modbus {
namespace {

constexpr ResponseShape kOne{.function = 4, .size = 4};
constexpr ResponseShape kTwo{.function = 4, .size = 6};
constexpr ResponseShape kCoils{.function = 1, .size = 3};

TEST(Unanswered, NothingMayComeUntilARequestIsGivenUp) {
  Unanswered sut;
  EXPECT_FALSE(sut.may_come(kOne));
  sut.answered(kOne);
  EXPECT_FALSE(sut.may_come(kOne));
  sut.given_up(kOne);
  EXPECT_TRUE(sut.may_come(kOne));
  EXPECT_FALSE(sut.may_come(kTwo));
}

TEST(Unanswered, AResponseThatCanOnlyBeTheLastOnesEndsAllDoubt) {
  Unanswered sut;
  sut.given_up(kOne);
  sut.given_up(kTwo);
  sut.answered(kCoils);
  EXPECT_FALSE(sut.may_come(kOne));
  EXPECT_FALSE(sut.may_come(kTwo));
}

// It may be that of the first one that it fits: the others are still to come.
TEST(Unanswered, AResponseThatFitsAnEarlierRequestLeavesThoseBehindIt) {
  Unanswered sut;
  sut.given_up(kOne);
  sut.given_up(kTwo);
  sut.answered(kTwo);
  EXPECT_FALSE(sut.may_come(kOne)) << "a device answers in order";
  EXPECT_TRUE(sut.may_come(kTwo));
  sut.answered(kOne);
  EXPECT_FALSE(sut.may_come(kTwo));
}

TEST(Unanswered, AnExceptionIsThatOfAnyRequestWithItsFunction) {
  Unanswered sut;
  sut.given_up(kOne);
  sut.refused(kTwo);
  EXPECT_FALSE(sut.may_come(kOne));
  EXPECT_TRUE(sut.may_come(kTwo));
  sut.refused(kCoils);
  EXPECT_FALSE(sut.may_come(kTwo));
}

TEST(Unanswered, RequestsOfAProcessBeforeFitEachResponse) {
  Unanswered sut = Unanswered::of_process_before();
  for (std::size_t i = 0; i < Unanswered::kOfProcessBefore; ++i) {
    EXPECT_TRUE(sut.may_come(kOne));
    EXPECT_TRUE(sut.may_come(kCoils)) << i;
    sut.answered(kOne);
  }
  EXPECT_TRUE(sut.may_come(kOne));
  EXPECT_FALSE(sut.may_come(kCoils));
}

TEST(Unanswered, NoMoreThanItsBoundAreKept) {
  Unanswered sut;
  sut.given_up(kCoils);
  for (std::size_t i = 0; i < Unanswered::kMost; ++i) sut.given_up(kOne);
  EXPECT_FALSE(sut.may_come(kCoils));
  EXPECT_TRUE(sut.may_come(kOne));
}

RegisterMap map_at(RegisterKind kind, std::uint16_t address, std::uint32_t count) {
  RegisterMap map;
  map.kind = kind;
  map.address = address;
  map.count = count;
  return map;
}
RegisterMap registers(std::uint16_t address, std::uint32_t count) {
  return map_at(RegisterKind::input_register, address, count);
}

// A device that answers each request with the response to the one so many before it.
class LateDevice {
 public:
  explicit LateDevice(std::size_t late) : late_(late) {}
  // False: no answer, or another one than was asked for.
  bool ask(const RegisterMap& map, Unanswered& sut) {
    requests_.push_back(map);
    bool fits = false;
    if (requests_.size() > late_) {
      fits = read_shape(requests_.front()) == read_shape(map);
      is_old_ = requests_.front().address != map.address;
      requests_.pop_front();
    }
    if (fits) {
      sut.answered(read_shape(map));
    } else {
      sut.given_up(read_shape(map));
    }
    return fits;
  }
  [[nodiscard]] bool is_old() const { return is_old_; }
  void hurry() {
    late_ = 0;
    requests_.clear();
  }

 private:
  std::size_t late_;
  std::deque<RegisterMap> requests_;
  bool is_old_ = false;
};

// As Device does it.
bool read_all(LateDevice& device, const std::vector<RegisterMap>& maps, Unanswered& sut) {
  for (const RegisterMap& map : maps) {
    while (sut.may_come(read_shape(map))) {
      const auto other = sut.probe(maps);
      if (!other) break;
      if (!device.ask(*other, sut)) return false;
    }
    if (!device.ask(map, sut)) return false;
    EXPECT_FALSE(device.is_old()) << "values of other registers";
  }
  return true;
}

TEST(Unanswered, ALateDeviceNeverGivesValuesOfOtherRegisters) {
  const std::vector<std::vector<RegisterMap>> plants{
      {registers(10, 1), registers(20, 1)},
      {registers(10, 2), registers(20, 2)},
      {registers(10, 1), registers(20, 2), registers(30, 1)},
      {registers(10, 125), registers(20, 125)},
      {registers(10, 1), registers(65'535, 1)},
      {map_at(RegisterKind::coil, 10, 8), map_at(RegisterKind::coil, 20, 3)},
  };
  for (const auto& maps : plants) {
    for (std::size_t late = 1; late <= Unanswered::kMost; ++late) {
      Unanswered sut;
      LateDevice device(late);
      for (int poll = 0; poll < 100; ++poll) {
        EXPECT_FALSE(read_all(device, maps, sut)) << late << ' ' << poll;
      }
      device.hurry();
      EXPECT_TRUE(read_all(device, maps, sut)) << "it is in time again";
    }
  }
}

TEST(Unanswered, OneMapThatHasNoOtherShapeCannotBeMixedUpWithOthers) {
  Unanswered sut;
  sut.given_up(kOne);
  EXPECT_FALSE(sut.probe({registers(10, 1)}));
  EXPECT_TRUE(sut.probe({registers(10, 2)}));
}

}  // namespace
}  // namespace plchost::modbus
