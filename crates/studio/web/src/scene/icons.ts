// The icons of commands.

import {
  Box, Boxes, Circle, Component, Cone, Cylinder, Disc, Lightbulb, type IconNode, Palette, Pill, Settings2, Shapes, Square, SquareRoundCorner, Sun, Torus, Triangle, Type,
  Video,
} from "lucide";

import type { Role } from "../protocol";

const COMMANDS: Readonly<Record<string, IconNode>> = {
  Sphere: Circle,
  Box,
  Triangle,
  Plane: Square,
  Disc,
  Cylinder,
  Cone,
  Torus,
  Capsule: Pill,
  Roundbox: SquareRoundCorner,
  Text: Type,
  Ilight: Sun,
  Plight: Lightbulb,
};

const ROLES: Readonly<Record<Role, IconNode>> = {
  object: Shapes,
  light: Lightbulb,
  use: Component,
  group: Boxes,
  material: Palette,
  camera: Video,
  setting: Settings2,
};

export function iconOf(command: string, role: Role): IconNode {
  return COMMANDS[command] ?? ROLES[role];
}
