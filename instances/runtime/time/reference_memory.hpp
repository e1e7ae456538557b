#pragma once

#include <memory>
#include <string>

#include "instances/runtime/time/reference.hpp"

namespace plchost {

/// A reference record of the pool, which firmware writes.
class ReferenceMemory final : public Reference {
 public:
  ReferenceMemory(DistributedClock& clock, std::string pool, std::string name);
  ~ReferenceMemory() override;

  void refresh() override;

 private:
  class Source;
  void attach();

  std::string pool_;
  std::string name_;
  std::unique_ptr<Source> source_;
};

}  // namespace plchost
