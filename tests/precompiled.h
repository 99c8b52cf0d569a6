// What nearly every file includes, and includes by itself: precompiled for the tests' objects and the sanitised floors, where it is a quarter to a third of the compilation.
#pragma once
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>
