(** Trees for regions and for limits.

    A region is a union of parts, each a list of conditions by their numbers.  A condition
    has two polynomials in time: [kept] is not negative where it holds, [broken] is positive
    where it fails.  At a margin the two differ, and both speak of a whole ball.  Covers are
    convex bodies within the region: its parts, and what parts become across faces. *)

Require Import Reals Lra Lia ZArith List Bool.
From LtlPlan Require Import Bernstein Crossing Halves Tree.
Import ListNotations.

(** ** The algorithm *)

Record condition := Condition { kept : list Z; broken : list Z }.
Record region := Region { parts : list (list nat); covers : list (list nat) }.

Inductive mark := Must | No | Cross | Open.
Inductive status := Kept | Broken | Unclear.

Definition both (f : list Z -> list Z) (q : condition) : condition :=
  Condition (f (kept q)) (f (broken q)).

Definition known_of (q : condition) : status :=
  if all_positive (broken q) then Broken else if all_nonneg (kept q) then Kept else Unclear.

Definition is_kept (s : status) : bool := match s with Kept => true | _ => false end.
Definition is_broken (s : status) : bool := match s with Broken => true | _ => false end.
Definition is_unclear (s : status) : bool := match s with Unclear => true | _ => false end.

Definition all_kept (r : region) (st : nat -> status) : bool :=
  existsb (forallb (fun k => is_kept (st k))) (covers r).
Definition all_broken (r : region) (st : nat -> status) : bool :=
  forallb (existsb (fun k => is_broken (st k))) (parts r).

Definition statuses (c : list condition) (k : nat) : status :=
  match nth_error c k with Some q => known_of q | None => Unclear end.
Definition with_status (st : nat -> status) (k : nat) (s : status) (j : nat) : status :=
  if (j =? k)%nat then s else st j.

(** The condition leaves nothing between where it holds and where it fails. *)
Fixpoint opposite (l m : list Z) : bool :=
  match l, m with
  | [], [] => true
  | x :: l', y :: m' => (x =? - y)%Z && opposite l' m'
  | _, _ => false
  end.

(** One condition alone is unclear, and decides. *)
Definition decides (r : region) (c : list condition) (k : nat) : bool :=
  let st := statuses c in
  forallb (fun j => (j =? k)%nat || negb (is_unclear (st j))) (seq 0 (length c))
  && all_kept r (with_status st k Kept) && all_broken r (with_status st k Broken).

Definition crossed (r : region) (c : list condition) : bool :=
  existsb (fun k =>
    match nth_error c k with
    | Some q => is_unclear (known_of q) && opposite (kept q) (broken q) && decides r c k
        && (comes (kept q) || comes (rev (kept q)))
    | None => false
    end) (seq 0 (length c)).

Definition holds (r : region) (m : mark) (c : list condition) : bool :=
  match m with
  | Must => all_kept r (statuses c)
  | No => all_broken r (statuses c)
  | Cross => crossed r c
  | Open => true
  end.

Definition check_region (r : region) (c : list condition) (steps : list (step mark)) :
    option (list (leaf mark)) :=
  check_tree _ _ (map (both first_half)) (map (both second_half)) (holds r) c steps.

(** ** What the marks say *)

Open Scope R_scope.

Definition times : Type := R -> R.

Section Marks.
  Variable r : region.
  (** The two functions of time of each condition, by its number. *)
  Variable f : nat -> times * times.

  Definition known (a b : R) (c : list condition) : Prop :=
    forall k q, nth_error c k = Some q ->
      represents (kept q) (fst (f k)) a b /\ represents (broken q) (snd (f k)) a b.

  (** By the polynomials, time [x] is in the region, where the margin is zero. *)
  Definition inside (x : R) : Prop :=
    exists p, In p (parts r) /\ forall k, In k p -> 0 <= fst (f k) x.

  Definition exact : Prop :=
    (forall k x, 0 < snd (f k) x -> fst (f k) x < 0) /\
    (forall x, (exists p, In p (covers r) /\ forall k, In k p -> 0 <= fst (f k) x) -> inside x).

  Definition says (m : mark) (a b : R) : Prop :=
    match m with
    | Open => True
    | Must => always (fun x => exists p, In p (covers r) /\ forall k, In k p -> 0 <= fst (f k) x) a b
    | No => always (fun x => forall p, In p (parts r) -> exists k, In k p /\ 0 < snd (f k) x) a b
    | Cross => exact -> comes_once inside a b \/ goes_once inside a b
    end.

  Lemma known_cut : forall (h : list Z -> list Z) a b a' b' c,
    (forall l g, represents l g a b -> represents (h l) g a' b') ->
    known a b c -> known a' b' (map (both h) c).
  Proof.
    intros h a b a' b' c H K k q N; rewrite nth_error_map in N.
    destruct (nth_error c k) as [q0|] eqn:E; [|discriminate]; injection N as <-.
    destruct (K k q0 E); split; cbn; auto.
  Qed.

  Lemma known_sound : forall a b c k x, a < b -> known a b c -> a <= x <= b ->
    (statuses c k = Kept -> 0 <= fst (f k) x) /\ (statuses c k = Broken -> 0 < snd (f k) x).
  Proof.
    intros a b c k x Hab K Hx; unfold statuses, known_of.
    destruct (nth_error c k) as [q|] eqn:E; [|split; discriminate].
    destruct (K k q E) as [K1 K2]; split; destruct (all_positive (broken q)) eqn:P;
      try discriminate; destruct (all_nonneg (kept q)) eqn:N; try discriminate; intros _.
    - apply (all_nonneg_sound (kept q) (fst (f k)) a b); auto.
    - apply (all_positive_sound (broken q) (snd (f k)) a b); auto.
    - apply (all_positive_sound (broken q) (snd (f k)) a b); auto.
  Qed.

  Lemma all_kept_sound : forall st x, (forall k, st k = Kept -> 0 <= fst (f k) x) ->
    all_kept r st = true -> exists p, In p (covers r) /\ forall k, In k p -> 0 <= fst (f k) x.
  Proof.
    intros st x S H; apply existsb_exists in H as (p & Hp & H); exists p; split; auto.
    rewrite forallb_forall in H; intros k Hk; specialize (H k Hk); apply S.
    destruct (st k); auto; discriminate.
  Qed.

  Lemma all_broken_sound : forall st (P : nat -> Prop), (forall k, st k = Broken -> P k) ->
    all_broken r st = true -> forall p, In p (parts r) -> exists k, In k p /\ P k.
  Proof.
    intros st P S H p Hp; unfold all_broken in H; rewrite forallb_forall in H.
    apply H, existsb_exists in Hp as (k & Hk & B); exists k; split; auto; apply S.
    destruct (st k); auto; discriminate.
  Qed.

  Lemma decides_sound : forall a b c k, a < b -> known a b c -> decides r c k = true -> exact ->
    forall x, a <= x <= b -> (0 <= fst (f k) x <-> inside x).
  Proof.
    intros a b c k Hab K D [E1 E2] x Hx; unfold decides in D.
    apply andb_prop in D as [D B]; apply andb_prop in D as [_ M].
    assert (S : forall j, j <> k -> (statuses c j = Kept -> 0 <= fst (f j) x)
      /\ (statuses c j = Broken -> fst (f j) x < 0)).
    { intros j _; destruct (known_sound a b c j x Hab K Hx) as [S1 S2]; split; auto. }
    split.
    - intros P; apply E2, (all_kept_sound (with_status (statuses c) k Kept)); auto.
      intros j; unfold with_status; destruct (Nat.eqb_spec j k) as [->|NE]; auto; apply S; auto.
    - intros (p & Hp & I); apply Rnot_lt_le; intros L.
      destruct (all_broken_sound (with_status (statuses c) k Broken) (fun j => fst (f j) x < 0))
        with (p := p) as (j & Hj & Lj); auto.
      + intros j; unfold with_status; destruct (Nat.eqb_spec j k) as [->|NE]; auto; apply S; auto.
      + specialize (I j Hj); lra.
  Qed.

  Lemma holds_sound : forall m a b c, a < b -> known a b c -> holds r m c = true -> says m a b.
  Proof.
    intros [| | |] a b c Hab K H; cbn in H |- *; auto.
    - intros x Hx; apply (all_kept_sound (statuses c)); auto.
      intros k; apply (known_sound a b c k x Hab K Hx).
    - intros x Hx; apply (all_broken_sound (statuses c)); auto.
      intros k; apply (known_sound a b c k x Hab K Hx).
    - intros E; apply existsb_exists in H as (k & _ & H).
      destruct (nth_error c k) as [q|] eqn:N; [|discriminate].
      apply andb_prop in H as [H C]; apply andb_prop in H as [_ D].
      destruct (K k q N) as [Kq _]; pose proof (decides_sound a b c k Hab K D E) as I.
      apply orb_prop in C as [C|C]; [left | right].
      + destruct (comes_sound _ _ a b Hab Kq C) as (z & Hz & Z); exists z; split; auto.
        intros x Hx; rewrite <- I, Z by auto; reflexivity.
      + destruct (goes_sound _ _ a b Hab Kq C) as (z & Hz & Z); exists z; split; auto.
        intros x Hx; rewrite <- I, Z by auto; reflexivity.
  Qed.

  (** The leaves of a checked tree cover the interval, and their marks are true. *)
  Theorem check_region_sound : forall c steps leaves, known 0 1 c ->
    check_region r c steps = Some leaves -> tiles mark says 0 1 leaves.
  Proof.
    intros c steps leaves K H.
    apply (check_tree_sound _ _ (map (both first_half)) (map (both second_half)) (holds r) known says)
      with c steps; auto.
    - intros a b d; apply known_cut; intros; apply first_represents; auto.
    - intros a b d; apply known_cut; intros; apply second_represents; auto.
    - apply holds_sound.
  Qed.

  (** *** From polynomials to every point of the tube *)

  Variables (Point : Type) (tube : R -> Point -> Prop).
  (** Conditions as sets of points; what their polynomials say of the tube. *)
  Variable meets : nat -> Point -> Prop.
  Hypothesis about : forall k t q, tube t q ->
    (0 <= fst (f k) t -> meets k q) /\ (0 < snd (f k) t -> ~ meets k q).

  Definition in_region (q : Point) : Prop :=
    exists p, In p (parts r) /\ forall k, In k p -> meets k q.

  Theorem no_tube : forall a b, says No a b ->
    forall t q, a <= t <= b -> tube t q -> ~ in_region q.
  Proof.
    intros a b S t q Ht Tq (p & Hp & I); destruct (S t Ht p Hp) as (k & Hk & P).
    destruct (about k t q Tq) as [_ N]; apply (N P), I; auto.
  Qed.

  Theorem must_tube : forall a b,
    (forall p, In p (covers r) -> forall q, (forall k, In k p -> meets k q) -> in_region q) ->
    says Must a b -> forall t q, a <= t <= b -> tube t q -> in_region q.
  Proof.
    intros a b C S t q Ht Tq; destruct (S t Ht) as (p & Hp & H); apply (C p Hp).
    intros k Hk; apply (about k t q Tq); auto.
  Qed.
End Marks.

(** Two parts at a face: where no point is beyond both of two inequalities, what is
    left of the parts without these lies in the two parts together. *)
Theorem across_face : forall (X : Type) (g h : X -> R) (A B : list (X -> R)) x,
  (g x <= 0 \/ h x <= 0) -> (forall f, In f (A ++ B) -> f x <= 0) ->
  (forall f, In f (g :: A) -> f x <= 0) \/ (forall f, In f (h :: B) -> f x <= 0).
Proof.
  intros X g h A B x [L|L] H; [left | right]; intros f [<-|Hf]; auto; apply H, in_or_app; auto.
Qed.

(** Half-spaces n.x <= a and -k n.x <= b with b >= -k a leave no point beyond both. *)
Theorem faces_meet : forall v k a b, 0 < k -> - k * a <= b -> v - a <= 0 \/ - k * v - b <= 0.
Proof. intros v k a b Hk H; destruct (Rle_lt_dec v a); [left; lra | right; nra]. Qed.

(** Of two faces with one normal the inner one makes the outer one needless. *)
Theorem needless_face : forall v a b, a < b -> v <= a -> v <= b.
Proof. intros; lra. Qed.

(** ** Limits: one polynomial that is nowhere negative *)

Definition check_nonneg (l : list Z) (steps : list (step unit)) : bool :=
  match check_tree _ _ first_half second_half (fun _ => all_nonneg) l steps with
  | Some (_ :: _) => true
  | _ => false
  end.

Theorem check_nonneg_sound : forall l f steps, represents l f 0 1 ->
  check_nonneg l steps = true -> always (fun x => 0 <= f x) 0 1.
Proof.
  intros l f steps K H x Hx; unfold check_nonneg in H.
  destruct (check_tree _ _ _ _ _ _ _) as [[|p leaves]|] eqn:E; try discriminate.
  pose proof (check_tree_sound _ _ first_half second_half (fun _ : unit => all_nonneg)
    (fun a b c => represents c f a b) (fun _ a b => always (fun x => 0 <= f x) a b)) as T.
  specialize (T (fun a b c => first_represents c f a b) (fun a b c => second_represents c f a b)
    (fun _ a b c L R => all_nonneg_sound c f a b L R) _ _ _ K E).
  destruct (tiles_cover _ _ _ _ _ x T Hx) as (m & k & d & _ & B & S); [discriminate|].
  apply S; auto.
Qed.
