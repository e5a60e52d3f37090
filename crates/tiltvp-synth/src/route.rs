//! Ways through a room that keep clear of everything: a grid of places that are free, and shortest paths on it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Vector2, Vector3};

use crate::encoders::wrapped;
use crate::options::RoomKind;
use crate::rng::Rng;
use crate::world::{ROBOT_RADIUS_M, World};

/// Size of a cell, metres: a third of the robot's radius.
const CELL_M: f64 = 0.08;

/// The places where a robot can drive, as cells of a grid.
pub(crate) struct Grid {
    low: Vector2<f64>,
    nx: usize,
    ny: usize,
    clearance: Vec<f64>,
    /// Where the robot can drive, in the largest connected part.
    open: Vec<bool>,
}

impl Grid {
    /// The places of a world at which a robot has room, also around a mast of the given height `reach` metres from its centre.
    pub(crate) fn new(world: &World, reach: f64, mast_m: f64) -> Self {
        let (low, high) = world.bounds();
        let count = |length: f64| (length / CELL_M).ceil().max(1.0) as usize;
        let (nx, ny) = (count(high.x - low.x), count(high.y - low.y));
        let mut grid = Self { low, nx, ny, clearance: vec![-1.0; nx * ny], open: vec![false; nx * ny] };
        // A robot may go below tables only where that is what the room is for.
        let height = if world.kind() == RoomKind::UnderTable { mast_m + 0.1 } else { (mast_m + 0.1).max(1.5) };
        let height = height.min(world.height_m() - 0.05);
        for k in 0..nx * ny {
            let at = grid.center(k);
            grid.clearance[k] = world.clearance(at.x, at.y);
            let is_wide = grid.clearance[k] > ROBOT_RADIUS_M.max(reach + 0.05) + CELL_M;
            grid.open[k] = is_wide && is_clear_above(world, &at, reach + 0.08, height);
        }
        grid.keep_largest_part();
        grid
    }

    /// Whether a robot can drive there.
    pub(crate) fn is_open(&self, at: &Vector2<f64>) -> bool {
        self.cell(at).is_some_and(|k| self.open[k])
    }

    /// Whether a robot has room there: close to a place where it can drive.
    pub(crate) fn has_room(&self, at: &Vector2<f64>) -> bool {
        self.is_within(0.97, at)
    }

    /// Whether a point is within so many sizes of a cell of the middle of an open one.
    fn is_within(&self, sizes: f64, at: &Vector2<f64>) -> bool {
        (0..9).any(|n| {
            let aside = Vector2::new(f64::from(n % 3 - 1), f64::from(n / 3 - 1)) * CELL_M;
            let near = self.cell(&(at + aside)).filter(|&k| self.open[k]);
            near.is_some_and(|k| (self.center(k) - at).norm() < sizes * CELL_M)
        })
    }

    /// Whether a robot has room all along a straight line.
    fn is_straight(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> bool {
        let count = ((to - from).norm() / (0.4 * CELL_M)).ceil().max(1.0) as usize;
        (1..=count).all(|k| self.is_within(0.85, &(from + (to - from) * (k as f64 / count as f64))))
    }

    /// The cells where a robot can drive.
    pub(crate) fn open_cells(&self) -> Vec<usize> {
        (0..self.open.len()).filter(|&k| self.open[k]).collect()
    }

    /// The middle of a cell.
    pub(crate) fn center(&self, k: usize) -> Vector2<f64> {
        self.low + Vector2::new((k % self.nx) as f64 + 0.5, (k / self.nx) as f64 + 0.5) * CELL_M
    }

    /// The cell of a point.
    pub(crate) fn cell(&self, at: &Vector2<f64>) -> Option<usize> {
        let place = (at - self.low) / CELL_M;
        let (i, j) = (place.x.floor(), place.y.floor());
        let within = i >= 0.0 && j >= 0.0 && (i as usize) < self.nx && (j as usize) < self.ny;
        within.then(|| j as usize * self.nx + i as usize)
    }

    /// A way from a point to a far place drawn at random, smooth or from cell to cell.
    pub(crate) fn way_from(
        &self,
        from: &Vector2<f64>,
        cells: &[usize],
        smooth: bool,
        rng: &mut Rng,
    ) -> Vec<Vector2<f64>> {
        let target = (0..12)
            .map(|_| cells[rng.below(cells.len())])
            .max_by(|a, b| (self.center(*a) - from).norm().total_cmp(&(self.center(*b) - from).norm()));
        let away = |k: usize| (self.center(k) - from).norm();
        let start = cells.iter().copied().min_by(|a, b| away(*a).total_cmp(&away(*b)));
        let (Some(start), Some(target)) = (start, target) else { return vec![*from] };
        let mut way = self.shortest(start, target);
        way.insert(0, *from);
        if smooth {
            self.smooth(&mut way);
        }
        way
    }

    /// The centres of cells from one cell to another: short, and away from things.
    fn shortest(&self, start: usize, target: usize) -> Vec<Vector2<f64>> {
        let mut cost = vec![f64::INFINITY; self.open.len()];
        let mut before = vec![usize::MAX; self.open.len()];
        let mut queue = BinaryHeap::new();
        cost[start] = 0.0;
        queue.push((Reverse(0u64), start));
        while let Some((Reverse(bits), k)) = queue.pop() {
            if k == target {
                break;
            }
            if f64::from_bits(bits) > cost[k] {
                continue;
            }
            for (next, length) in self.neighbours(k) {
                let dear = 1.0 + 0.25 / (self.clearance[next] - ROBOT_RADIUS_M + 0.05).max(0.05);
                let sum = cost[k] + length * dear;
                if sum < cost[next] {
                    cost[next] = sum;
                    before[next] = k;
                    // The bits of positive numbers are in their order.
                    queue.push((Reverse(sum.to_bits()), next));
                }
            }
        }
        let mut way = vec![self.center(target)];
        let mut k = target;
        while k != start && before[k] != usize::MAX {
            k = before[k];
            way.push(self.center(k));
        }
        way.reverse();
        way
    }

    fn neighbours(&self, k: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (i, j) = ((k % self.nx) as isize, (k / self.nx) as isize);
        (0..9isize).filter(|n| *n != 4).filter_map(move |n| {
            let (di, dj) = (n % 3 - 1, n / 3 - 1);
            let (x, y) = (i + di, j + dj);
            let within = x >= 0 && y >= 0 && x < self.nx as isize && y < self.ny as isize;
            let next = (y * self.nx as isize + x) as usize;
            let length = if di != 0 && dj != 0 { std::f64::consts::SQRT_2 } else { 1.0 };
            (within && self.open[next]).then_some((next, length))
        })
    }

    /// Pulls every point but the ends towards the middle of its neighbours, where there is room.
    fn smooth(&self, way: &mut [Vector2<f64>]) {
        for _ in 0..80 {
            for k in 1..way.len().saturating_sub(1) {
                let moved = way[k] * 0.4 + (way[k - 1] + way[k + 1]) * 0.3;
                if self.is_open(&moved) {
                    way[k] = moved;
                }
            }
        }
    }

    fn keep_largest_part(&mut self) {
        let mut part = vec![usize::MAX; self.open.len()];
        let mut best: (usize, usize) = (0, usize::MAX);
        for first in 0..self.open.len() {
            if !self.open[first] || part[first] != usize::MAX {
                continue;
            }
            let (mut size, mut stack) = (0, vec![first]);
            part[first] = first;
            while let Some(k) = stack.pop() {
                size += 1;
                let next: Vec<usize> = self.neighbours(k).map(|n| n.0).filter(|n| part[*n] == usize::MAX).collect();
                for n in next {
                    part[n] = first;
                    stack.push(n);
                }
            }
            if size > best.0 {
                best = (size, first);
            }
        }
        for (open, part) in self.open.iter_mut().zip(&part) {
            *open = *open && *part == best.1;
        }
    }
}

/// Whether nothing hangs above a point of the floor and a ring around it.
fn is_clear_above(world: &World, at: &Vector2<f64>, ring: f64, height: f64) -> bool {
    (0..9).all(|k| {
        let (s, c) = (std::f64::consts::TAU * f64::from(k) / 8.0).sin_cos();
        let radius = if k == 8 { 0.0 } else { ring };
        let from = Vector3::new(at.x + radius * c, at.y + radius * s, 0.02);
        world.scene().is_clear(&from, &Vector3::z(), height)
    })
}

/// Follows a way with a robot that turns and speeds up gently.
pub(crate) struct Follower {
    way: Vec<Vector2<f64>>,
    /// Next point of the way.
    at: usize,
    speed: f64,
    turn: f64,
    waited: usize,
    careful: bool,
}

impl Follower {
    /// Goes along a way from its start, at rest.
    pub(crate) fn new(way: Vec<Vector2<f64>>) -> Self {
        Self { way, at: 0, speed: 0.0, turn: 0.0, waited: 0, careful: false }
    }

    /// Takes another way, in full motion.
    pub(crate) fn follow(&mut self, way: Vec<Vector2<f64>>) {
        self.careful = self.is_stuck();
        (self.way, self.at, self.waited) = (way, 0, 0);
    }

    /// Whether the way is done.
    pub(crate) fn is_done(&self) -> bool {
        self.at + 2 >= self.way.len()
    }

    /// Whether the robot does not get on.
    pub(crate) fn is_stuck(&self) -> bool {
        self.waited > 10
    }

    /// The next step from where the robot is: distance in metres and turn in radians, at most `step_m` and `turn_max_rad`;
    /// `is_open` says whether a motion ends, and passes, where there is room. It heads for the farthest point of the way, up
    /// to a step of a person, that it can go to straight.
    pub(crate) fn next(
        &mut self,
        grid: &Grid,
        at: &Vector2<f64>,
        yaw_rad: f64,
        limits: (f64, f64),
        is_open: impl Fn(f64, f64) -> bool,
    ) -> (f64, f64) {
        let (step_m, turn_max_rad) = limits;
        let window = self.at..(self.at + 12).min(self.way.len());
        let near = window.min_by(|a, b| (self.way[*a] - at).norm().total_cmp(&(self.way[*b] - at).norm()));
        self.at = near.unwrap_or(self.at);
        let last = self.way.len() - 1;
        let far = (self.at..last).find(|k| (self.way[*k] - at).norm() > 0.45).unwrap_or(last);
        let ahead = (self.at + 1..=far).rev().find(|k| grid.is_straight(at, &self.way[*k]));
        // Where there is hardly room, from point to point.
        self.careful &= self.at < 8;
        let next = if (self.way[self.at] - at).norm() > 0.015 { self.at } else { (self.at + 1).min(last) };
        let to = self.way[ahead.filter(|_| !self.careful).unwrap_or(next)] - at;
        let off = wrapped(to.y.atan2(to.x) - yaw_rad);
        let wished_turn = (0.3 * off).clamp(-turn_max_rad, turn_max_rad);
        let wished_speed = if off.abs() > 0.8 { 0.0 } else { step_m * (1.0 - off.abs()) };
        let (more, turn_more) = (0.2 * step_m, 0.35 * turn_max_rad);
        let speed = self.speed + (wished_speed - self.speed).clamp(-2.0 * more, more);
        let turn = self.turn + (wished_turn - self.turn).clamp(-turn_more, turn_more);
        let speed = [speed, 0.5 * speed, 0.25 * speed].into_iter().find(|s| is_open(*s, turn)).unwrap_or(0.0);
        self.waited = if speed < 0.02 * step_m && off.abs() < 0.02 { self.waited + 1 } else { 0 };
        (self.speed, self.turn) = (speed, turn);
        (speed, turn)
    }
}
