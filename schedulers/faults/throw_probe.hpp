#pragma once

namespace plchost {

/// Never thrown, so a handler of it catches nothing. It stands before `catch (...)`. The C++ runtime then
/// asks it about each exception that no handler below takes. At that time the functions that have thrown it
/// are still on the stack, and FaultTrap::throw_leaves() looks at them. An exception that the code catches
/// itself does not come so far, and costs nothing more than without.
class ThrowProbe {
 public:
  /// Defined nowhere: so the compiler leaves its type_info to throw_probe.cpp.
  virtual ~ThrowProbe();
};

}  // namespace plchost
