#pragma once

#include <algorithm>
#include <cmath>

/// The machine: a motor that moves a carriage on a screw, with friction. Its input is the motor's force in N.
class Carriage {
 public:
  void step(double seconds, double force) {
    const double friction = kViscous * velocity_ + kCoulomb * std::tanh(velocity_ / 0.001);
    velocity_ += (force - friction) / kMass * seconds;
    position_ += velocity_ * seconds;
  }
  [[nodiscard]] double position() const { return position_; }  // m
  [[nodiscard]] double velocity() const { return velocity_; }  // m/s

 private:
  static constexpr double kMass = 8.0;      // kg
  static constexpr double kViscous = 12.0;  // N s/m
  static constexpr double kCoulomb = 6.0;   // N
  double position_ = 0.0;
  double velocity_ = 0.0;
};

/// A move with limited velocity and acceleration, planned anew in each cycle: it brakes in time, and never
/// jumps.
class Trajectory {
 public:
  void step(double seconds, double target) {
    const double distance = target - position_;
    const double direction = distance < 0.0 ? -1.0 : 1.0;
    // The velocity from which it can still stop at the target.
    const double braking = std::sqrt(2.0 * kAcceleration * std::fabs(distance));
    // In the last cycles the limit is what arrives in one cycle: no swinging around the target.
    const double wanted = direction * std::min({kVelocity, braking, std::fabs(distance) / seconds});
    const double change = kAcceleration * seconds;
    velocity_ = std::clamp(wanted, velocity_ - change, velocity_ + change);
    position_ += velocity_ * seconds;
  }
  [[nodiscard]] double position() const { return position_; }
  [[nodiscard]] double velocity() const { return velocity_; }

 private:
  static constexpr double kVelocity = 0.8;      // m/s
  static constexpr double kAcceleration = 4.0;  // m/s^2
  double position_ = 0.0;
  double velocity_ = 0.0;
};

/// The cascade of a servo drive: position (P, with velocity feed-forward) over velocity (PI, force limited).
class Servo {
 public:
  /// The force for this cycle.
  [[nodiscard]] double step(double seconds, const Trajectory& wanted, const Carriage& actual) {
    const double velocity = wanted.velocity() + kPosition * (wanted.position() - actual.position());
    const double error = velocity - actual.velocity();
    const double force = kVelocity * error + integral_;
    const double limited = std::clamp(force, -kMaxForce, kMaxForce);
    if (force == limited) integral_ += kIntegral * error * seconds;  // else it would wind up
    return limited;
  }

 private:
  static constexpr double kPosition = 60.0;     // 1/s
  static constexpr double kVelocity = 1600.0;   // N s/m
  static constexpr double kIntegral = 80000.0;  // N/m
  static constexpr double kMaxForce = 200.0;    // N
  double integral_ = 0.0;
};
