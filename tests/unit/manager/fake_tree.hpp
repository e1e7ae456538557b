#pragma once

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "manager/host_check/host_check.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {

/// A host made of files in a temporary folder, with instance "line1" on core 2 and "line2" on core 3 of four.
class FakeTree {
 public:
  FakeTree() {
    root_ = own_path("host");
    std::filesystem::create_directories(root_);
    write("/sys/devices/system/cpu/online", "0-3\n");
    host = {.files = HostFiles(root_), .instances = {{"line1", 2}, {"line2", 3}}, .try_fifo = [this] {
              return fifo_error;
            }};
  }
  ~FakeTree() {
    std::error_code ignored;
    std::filesystem::remove_all(root_, ignored);
  }
  FakeTree(const FakeTree&) = delete;
  FakeTree& operator=(const FakeTree&) = delete;

  void write(const std::string& path, const std::string& text) const {
    const std::filesystem::path file = root_.string() + path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
  }
  void make_folder(const std::string& path) const {
    std::filesystem::create_directories(root_.string() + path);
  }
  void remove(const std::string& path) const { std::filesystem::remove_all(root_.string() + path); }
  /// There, but cannot be read as a file: even root gets an error.
  void make_unreadable(const std::string& path) const {
    remove(path);
    make_folder(path);
  }
  /// The findings of the check of that name.
  [[nodiscard]] HostFinding look(std::string_view id) const {
    for (const HostCheck& check : host_checks()) {
      if (check.id == id) return check.look(host);
    }
    HostFinding none;
    none.id = "no such check";
    return none;
  }

  CheckedHost host;
  int fifo_error = 0;

 private:
  std::filesystem::path root_;
};

}  // namespace plchost
