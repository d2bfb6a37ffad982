import * as THREE from 'three';
import { expect, test } from 'vitest';
import { Room } from '../src/scene/room';

const meshes = (room: Room): THREE.Mesh[] => {
  const found: THREE.Mesh[] = [];
  room.traverseVisible((part) => { if (part instanceof THREE.Mesh) found.push(part); });
  return found;
};

test('a screen for shadows is there only where shadows fall', () => {
  const room = new Room(false), screens = (): number => meshes(room).filter(({ material }) => material instanceof THREE.ShadowMaterial).length;
  expect(screens()).toBe(1);
  room.showShadows(false);
  expect(screens()).toBe(0);
});

test('a processor that draws gets simpler light, of the same colours', () => {
  const [usual, simple] = [false, true].map((software) => {
    const room = new Room(software);
    room.setDark(true);
    return meshes(room).find(({ material }) => material instanceof THREE.MeshStandardMaterial || material instanceof THREE.MeshLambertMaterial)!;
  });
  expect(usual!.material).toBeInstanceOf(THREE.MeshStandardMaterial);
  expect(simple!.material).toBeInstanceOf(THREE.MeshLambertMaterial);
  expect((simple!.material as THREE.MeshLambertMaterial).color.getHex()).toBe((usual!.material as THREE.MeshStandardMaterial).color.getHex());
});
