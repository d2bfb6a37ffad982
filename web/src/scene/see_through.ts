import * as THREE from 'three';
import type { Arm } from './arm';

/** s between two checks; s for which the arm may hide the glass; 1/s, rate of the change. */
const LOOK = 0.3, PATIENCE = 0.5, RATE = 3;
/** m in front of the glass's middle: parts that hold the glass do not count as hiding it. */
const NEAR = 0.1, NEAR_GRIPPER = 0.2;

/** Makes the arm translucent if it hides the glass for long. */
export class SeeThrough {
  readonly #ray = new THREE.Raycaster();
  readonly #glass = new THREE.Vector3(); // world frame
  readonly #hits: THREE.Intersection[] = [];
  #due = 0;
  #hidden = 0;
  #hides = false;
  #opacity = 1;
  /** Opacity of the translucent arm. */
  faint = 0.3;

  /** @param dt s, since the last frame */
  update(arm: Arm, camera: THREE.Camera, glass: THREE.Object3D, isGripper: boolean, dt: number): void {
    this.#due -= dt;
    if (this.#due <= 0) {
      this.#due = LOOK;
      this.#look(arm, camera, glass, isGripper ? NEAR_GRIPPER : NEAR);
    }
    this.#hidden = this.#hides ? this.#hidden + dt : 0;
    const wanted = this.#hidden > PATIENCE ? this.faint : 1, step = RATE * Math.min(dt, 0.2);
    if (this.#opacity === wanted) return;
    this.#opacity = wanted < this.#opacity ? Math.max(wanted, this.#opacity - step) : Math.min(wanted, this.#opacity + step);
    arm.setOpacity(this.#opacity);
  }

  #look(arm: Arm, camera: THREE.Camera, glass: THREE.Object3D, near: number): void {
    const { ray } = this.#ray;
    ray.origin.setFromMatrixPosition(camera.matrixWorld);
    ray.direction.copy(glass.getWorldPosition(this.#glass)).sub(ray.origin);
    this.#ray.far = Math.max(0, ray.direction.length() - near);
    ray.direction.normalize();
    this.#hits.length = 0;
    for (const body of arm.bodies) if (this.#hits.length === 0) this.#ray.intersectObject(body, false, this.#hits);
    this.#hides = this.#hits.length > 0;
  }
}
