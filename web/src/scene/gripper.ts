import * as THREE from 'three';

/** m: a Robotiq 2F-85, from the flange, with the values of tasks/tools/robotiq_2f85.xml. */
const PADS = 0.143, KNUCKLE = { y: 0.0306, z: 0.0549 }, LINK = { y: 0.0376, z: 0.043 }, CLOSED = 0.8;
const DARK = 0x4a525c, GREY = 0x6e7884, PAD = 0x15181c;

/**
 * A gripper with its fingers at the measured opening. Its frame is between the pads: z back to the flange, y the way
 * they close.
 */
export class Gripper extends THREE.Group {
  readonly #knuckles: THREE.Group[] = [];
  readonly #fingers: THREE.Group[] = [];
  #shown = NaN;

  /** @param material of all parts, for a mere symbol of a gripper */
  constructor(material: THREE.Material | null = null) {
    super();
    const paint = (color: number, roughness: number): THREE.Material => material ?? new THREE.MeshStandardMaterial({ color, roughness, metalness: 0.3 });
    const dark = paint(DARK, 0.5), grey = paint(GREY, 0.45), rubber = paint(PAD, 0.9);
    // From the flange outward along z, as in its file.
    const body = new THREE.Group();
    body.rotation.x = Math.PI;
    body.position.z = PADS;
    this.add(body);
    const solid = (parent: THREE.Object3D, geometry: THREE.BufferGeometry, of: THREE.Material, y: number, z: number): THREE.Mesh => {
      const mesh = new THREE.Mesh(geometry, of);
      mesh.position.set(0, y, z);
      mesh.castShadow = material === null;
      parent.add(mesh);
      return mesh;
    };
    solid(body, new THREE.CylinderGeometry(0.0375, 0.0375, 0.03, 40).rotateX(Math.PI / 2), dark, 0, 0.015);
    solid(body, new THREE.BoxGeometry(0.06, 0.072, 0.05), dark, 0, 0.055);
    solid(body, new THREE.BoxGeometry(0.03, 0.06, 0.018), grey, 0, 0.086);
    for (const side of [1, -1]) {
      const knuckle = new THREE.Group(), finger = new THREE.Group(), half = new THREE.Group();
      half.rotation.z = side > 0 ? 0 : Math.PI;
      knuckle.position.set(0, KNUCKLE.y, KNUCKLE.z);
      const bar = solid(knuckle, new THREE.CapsuleGeometry(0.007, Math.hypot(LINK.y, LINK.z), 6, 16).rotateX(Math.PI / 2), grey, LINK.y / 2, LINK.z / 2);
      bar.rotation.x = -Math.atan2(LINK.y, LINK.z);
      finger.position.set(0, LINK.y, LINK.z);
      solid(finger, new THREE.BoxGeometry(0.022, 0.012, 0.038), dark, -0.0125, 0.031);
      solid(finger, new THREE.BoxGeometry(0.022, 0.00635, 0.0375), rubber, -0.02202, 0.03242);
      solid(finger, new THREE.BoxGeometry(0.018, 0.016, 0.022), grey, -0.004, 0.008);
      knuckle.add(finger);
      half.add(knuckle);
      body.add(half);
      this.#knuckles.push(knuckle);
      this.#fingers.push(finger);
    }
    this.open(0);
  }

  /** @param closed 0 open to 1 closed */
  open(closed: number): void {
    if (closed === this.#shown) return;
    this.#shown = closed;
    const angle = CLOSED * Math.min(1, Math.max(0, closed));
    for (const knuckle of this.#knuckles) knuckle.rotation.x = angle;
    for (const finger of this.#fingers) finger.rotation.x = -angle; // the pads stay parallel
  }

  /** m, distance between the pads; for tests. */
  get gap(): number {
    const [one, other] = this.#fingers.map((finger) => finger.localToWorld(new THREE.Vector3(0, -0.0252, 0.0324)));
    return one!.distanceTo(other!);
  }
}
