// A sun's direction as two angles in degrees: its height above the horizon, and its azimuth, which is 0 in front of the
// scene (+z) and 90 at its right (+x). The direction of the language is that of the light, away from the sun.

export interface SunAngles {
  readonly azimuth: number;
  readonly height: number;
}

const DEGREE = Math.PI / 180;
const tenth = (x: number): number => Math.round(x * 10) / 10 + 0;

export function sunAngles(x: number, y: number, z: number): SunAngles {
  return { azimuth: tenth(Math.atan2(0 - x, 0 - z) / DEGREE), height: tenth(Math.atan2(0 - y, Math.hypot(x, z)) / DEGREE) };
}

export function sunDirection({ azimuth, height }: SunAngles): readonly number[] {
  const [a, h] = [azimuth * DEGREE, height * DEGREE];
  return [-Math.sin(a) * Math.cos(h), -Math.sin(h), -Math.cos(a) * Math.cos(h)].map((x) => Math.round(x * 1e5) / 1e5 + 0);
}
