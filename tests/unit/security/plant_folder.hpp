#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "api/security/identity.hpp"
#include "api/security/security_folder.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::security {

/// A security folder of one test, removed at its end.
class PlantFolder : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(base);
    std::filesystem::create_directory(base);
    ASSERT_TRUE(SecurityFolder::init(plant, "host"));
  }
  void TearDown() override { std::filesystem::remove_all(base); }

  [[nodiscard]] SecurityFolder open() const { return SecurityFolder::open(plant).value(); }
  void add(Role role, const std::string& name) const { ASSERT_TRUE(open().add(role, name)); }
  [[nodiscard]] std::string folder(const std::string& name) const { return file_in(plant, name); }
  [[nodiscard]] std::string file(const std::string& name, std::string_view file) const {
    return file_in(folder(name), file);
  }
  /// The fault of the identity in that folder; empty: none.
  [[nodiscard]] std::string fault(const std::string& name) const {
    const auto checked = check_identity(folder(name));
    return checked ? "" : checked.error().describe();
  }
  static std::string contents(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  static void write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

  std::string base = own_path("security");
  std::string plant = base + "/plant";
};

}  // namespace plchost::security
