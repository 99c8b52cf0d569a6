#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fit/fit.h"

namespace unrig {

/// A search goes by the order of its runs here and there, and so do sums of rounded numbers. So the runs are searched in an order of their own, and told of in that in which they were given.

/// Places in `runs` in an order that goes by nothing but what they hold: decays first, then by density, angle before the motion, speed, length and fingerprint. As they stand where two have one file name.
std::vector<std::size_t> order_of_search(const std::vector<Run>& runs);
std::vector<Run> in_order(const std::vector<Run>& runs, const std::vector<std::size_t>& order);
bool is_as_given(const std::vector<std::size_t>& order);

/// The place of each run by its file.
class GivenOrder {
 public:
  explicit GivenOrder(const std::vector<Run>& runs);
  /// Behind all runs where it is none of them.
  std::size_t operator()(const std::string& file) const;

  /// Sorts what belongs to one run each; `file_of` says to which.
  template <class Item, class FileOf>
  void sort(std::vector<Item>& items, const FileOf& file_of) const {
    std::vector<Item> sorted;
    for (const std::size_t i : places(items, file_of)) sorted.push_back(std::move(items[i]));
    items = std::move(sorted);
  }
  /// The places of such items in the order in which their runs were given.
  template <class Item, class FileOf>
  std::vector<std::size_t> places(const std::vector<Item>& items, const FileOf& file_of) const {
    std::vector<std::string> files;
    for (const Item& item : items) files.push_back(file_of(item));
    return places_of(files);
  }
  /// Of items that have a name and the file of their run, or none: those of one name change places among themselves.
  template <class Item>
  std::vector<std::size_t> places_by_name(const std::vector<Item>& items) const {
    std::vector<std::pair<std::string, std::string>> named;
    for (const Item& item : items) named.emplace_back(item.name, item.run);
    return places_of(named);
  }
  template <class Item>
  void sort_by_name(std::vector<Item>& items) const {
    std::vector<Item> sorted;
    for (const std::size_t i : places_by_name(items)) sorted.push_back(std::move(items[i]));
    items = std::move(sorted);
  }
  /// The same of (name, file).
  std::vector<std::size_t> places_of(const std::vector<std::pair<std::string, std::string>>& named) const;

 private:
  std::vector<std::size_t> places_of(const std::vector<std::string>& files) const;

  std::map<std::string, std::size_t> place_;
};

/// The result of a fit to the same runs in the order of its search, told in that in which they were given.
void tell_as_given(const GivenOrder& given, FitResult& result);

}  // namespace unrig
